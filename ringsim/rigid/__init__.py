"""The ring as a mechanism of rigid rods: assembly, start, statics, and the margin of its drive."""
