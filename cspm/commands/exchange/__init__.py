"""Commands that hand plants to other simulators."""
