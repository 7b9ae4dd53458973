"""Kinds of structure, one file each: fields and ``layout(scene, coordinate)``."""
