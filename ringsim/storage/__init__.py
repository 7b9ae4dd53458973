"""What a campaign keeps on disk: design, journals, and the merged file."""
