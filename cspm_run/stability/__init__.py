"""Whether a run is stable: its loops before it, its tensions and limits after it."""
