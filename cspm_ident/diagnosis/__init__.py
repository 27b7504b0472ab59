"""Diagnosis: from recordings and a test-bed file to the physics that the file lacks."""
