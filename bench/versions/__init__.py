"""What a run costs, version by version: benchmarks for `asv`."""
