"""Standards for the margin of a drive, one file each."""
