"""Cables identified one at a time, on a machine without bar (thesis, 3-2 and 4-1)."""
