"""Kinds of friction in the joints, one file each."""
