"""What both engines compute in compiled code: vectors, and the tension chain of the cables."""

from ringsim.compile_cache import choose_folder

choose_folder()  # numba asks for it once, when the kernels are imported, by whomever
