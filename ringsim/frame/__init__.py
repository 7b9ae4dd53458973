"""The frame engine: rings in joint coordinates, compiled; see docs/theory/frame.md."""

from ringsim.compile_cache import choose_folder

choose_folder()  # numba asks for it once, when the kernels are imported, by whomever
