"""Waves, motion controller, tension distribution, force controller, and their design."""
