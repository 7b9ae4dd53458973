"""Kinds of rods, one file each."""
