"""Faults of the structure, one file each."""
