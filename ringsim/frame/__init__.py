"""The frame engine: rings in joint coordinates, compiled; see docs/frame.md."""
