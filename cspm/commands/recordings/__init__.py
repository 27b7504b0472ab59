"""Commands that take recordings elsewhere."""
