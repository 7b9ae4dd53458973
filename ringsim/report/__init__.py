"""The report of a campaign: one page that holds all it shows, and loads nothing."""
