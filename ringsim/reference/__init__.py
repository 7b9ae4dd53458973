"""What scenes and campaigns may hold: every key with its unit, default, range and meaning.

All of it is read from the records themselves, so that no description can disagree with them.
"""
