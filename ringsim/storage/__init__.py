"""What a campaign keeps on disk: design, journals, shards, and the merged file."""
