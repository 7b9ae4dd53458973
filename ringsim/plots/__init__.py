"""Figures of a run: pure functions from a dataset to a figure, one figure a file."""
