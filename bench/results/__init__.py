"""The numbers and pictures of docs/results.md: `python -m bench.results`."""
