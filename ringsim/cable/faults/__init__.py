"""Kinds of cable faults, one file each."""
