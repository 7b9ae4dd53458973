"""Who runs which sample, and how one run is kept apart from all others."""
