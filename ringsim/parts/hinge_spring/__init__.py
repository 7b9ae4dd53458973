"""Kinds of springs in the V-joints, one file each."""
