"""Effects on the bar, one per file."""
