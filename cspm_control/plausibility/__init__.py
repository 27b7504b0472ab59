"""Whether measured numbers can be true of this machine: what trips a run in real time."""
