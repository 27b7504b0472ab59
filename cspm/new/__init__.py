"""A robot of one's own: its first test-bed and scenario, written with comments."""
