"""Cables over pulleys: friction, tension chain, tangents, winches and faults; numpy only.

Nothing here knows bodies or joints: the input is where the pulleys are and how they move, the
output is the force on each of them.
"""
