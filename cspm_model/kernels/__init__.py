"""Compiled laws of cables, bar and motions: pure functions of flat float64 arrays, SI units."""
