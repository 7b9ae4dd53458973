"""Kinds of structure, one file each."""
