"""Kinds of friction between a rope and its pulleys, one file each."""
