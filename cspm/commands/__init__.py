"""Implementation of each command: reads inputs, calls a package, prints and writes results."""
