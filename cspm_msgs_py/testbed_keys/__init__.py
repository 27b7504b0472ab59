"""Parts of the test-bed file."""
