"""Kinds of winding laws, one file each."""
