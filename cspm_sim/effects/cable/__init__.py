"""Effects on cables, one per file."""
