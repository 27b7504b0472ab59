"""Faults that are put into a run in real time from outside."""
