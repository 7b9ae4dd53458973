"""Kinds of stops, one file each."""
