"""Cables over pulleys: records, laws of friction and winding, winches, controllers, ropes, faults.

Independent of bodies and joints.  How a rope's tensions follow from the motion of its pulleys is
computed in ``ringsim.core``; ``ringsim.cable.chain`` is what that tells of an instant.
"""
