"""Effects on sensors, one per file."""
