"""Experiments that tell apart what recordings so far cannot."""
