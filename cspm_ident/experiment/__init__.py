"""Experiments that separate what recordings so far cannot."""
