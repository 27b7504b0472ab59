"""Effects on the winch frame, one per file."""
