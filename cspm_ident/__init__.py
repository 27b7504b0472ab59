"""From recordings to a model: bring recordings in, compare them, identify parameters."""
