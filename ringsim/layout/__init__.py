"""What a structure consists of, in numpy: read by every engine, by theory, checks and drawings."""
