"""What a run gives: one file an output, with its declaration, how it is read and reduced.

A new output is one file in this folder with a subclass of ``Output``.  Datasets, campaign files,
the summary of a run and ``ringsim explain`` follow from what it declares.
"""

from ringsim.choice import load_package
from ringsim.outputs.family import COORDINATES, OUTPUTS, VARIABLES, Output

__all__ = ["COORDINATES", "OUTPUTS", "VARIABLES", "Output"]

load_package(__name__)
