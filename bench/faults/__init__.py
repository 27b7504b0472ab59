"""Random faults in a run in real time, and whether anything unsafe came of them."""
