"""Measurements of the project itself, not installed: diagnosis, accuracy, speed, results."""
