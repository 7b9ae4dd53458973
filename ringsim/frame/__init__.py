"""The frame engine: rings in joint coordinates, compiled; see docs/theory/frame.md."""
