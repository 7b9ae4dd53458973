"""Reading results: datasets in, datasets out; nothing here runs a simulation."""

from ringsim.analysis import accessor as accessor  # datasets have ``dataset.ring``
