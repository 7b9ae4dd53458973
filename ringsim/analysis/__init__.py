"""Reading results: datasets in, datasets out; nothing here runs a simulation."""

import ringsim

ringsim.register()  # who reads results may ask them: dataset.ring
