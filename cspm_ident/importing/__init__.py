"""Recordings of others become contract recordings, by a mapping that says what each number is."""
