"""Scoring of diagnoses against a truth that they did not know."""
