"""A viewer of recordings and runs: one page with the machine in 3-D beside its signals."""
