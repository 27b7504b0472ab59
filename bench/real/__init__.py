"""Diagnoses of recordings that other laboratories published, against what is true of them."""
