"""Identifying parameters from recordings, with 95 % intervals."""
