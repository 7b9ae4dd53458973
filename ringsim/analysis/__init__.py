"""Reading results: datasets in, datasets out; nothing here runs a simulation."""
