"""What moving each threshold of the diagnosis changes on a fixed set of development recordings."""
