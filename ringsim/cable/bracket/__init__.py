"""Kinds of brackets that hold the V pulleys, one file each."""
