"""Message types by their definitions alone, for packages that are not installed."""
