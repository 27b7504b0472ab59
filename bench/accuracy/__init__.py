"""How exact comparisons, identifications and intervals are, by simulation."""
