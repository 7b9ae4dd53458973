"""The frame engine: rings in joint coordinates, compiled; see docs/frame.md."""

from ringsim.compile_cache import choose_folder, pack_numbers

# numba asks for both once, when the kernels are imported, by whomever.
choose_folder()
pack_numbers()
