"""From recordings to a model: bring recordings in, compare, identify parameters, diagnose."""
