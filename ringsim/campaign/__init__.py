"""Campaigns: many samples of one scene, run so that nothing finished is ever lost."""
