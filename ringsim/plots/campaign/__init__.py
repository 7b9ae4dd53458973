"""Figures of a campaign: pure functions from ``campaign.nc`` to a figure, one figure a file."""
