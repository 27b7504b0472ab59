"""What hold-out data say of findings: tests, simulations, detection limits."""
