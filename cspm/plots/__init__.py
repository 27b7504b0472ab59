"""Figures of runs, analyses, identifications and diagnoses, drawn with matplotlib."""
