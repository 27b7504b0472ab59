"""Validation of findings on held-out data: tests, simulations, detection limits."""
