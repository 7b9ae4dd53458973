"""The ring as a mechanism of rigid rods: mobility, start, statics, and the margin of its drive."""
