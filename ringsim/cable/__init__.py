"""Cables over pulleys: friction, tension chain, tangents, winches and faults; numpy only.

Independent of bodies and joints: the input are positions and velocities of the pulleys, the
output is the force on each of them.
"""
