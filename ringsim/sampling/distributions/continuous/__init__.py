"""Kinds of continuous distributions, one file each."""
