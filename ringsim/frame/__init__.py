"""The frame engine: rings in joint coordinates, in C; see docs/theory/frame.md."""
