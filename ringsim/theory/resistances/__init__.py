"""Kinds of resistance to opening, one file each."""
