"""Analyses of a machine and its controllers, as results that a script and a command share."""
