"""Effects on winches, one per file."""
