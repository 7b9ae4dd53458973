"""ringsim: how large deployable ring antennas open."""
