"""Kinds of distributions, one file each."""
