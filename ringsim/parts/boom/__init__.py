"""Kinds of boom, one file each."""
