"""Compiled kernels: pure functions of flat float64 arrays, SI units, no checks."""
