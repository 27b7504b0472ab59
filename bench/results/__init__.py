"""The numbers and pictures of results/steep-sea.md: `python -m bench.results`."""
