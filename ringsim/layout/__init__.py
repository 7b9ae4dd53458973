"""What a structure consists of, in numpy: read by engines, the rigid mechanism and drawings."""
