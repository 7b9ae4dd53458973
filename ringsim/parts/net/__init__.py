"""Kinds of nets, one file each."""
