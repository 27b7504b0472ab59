"""Signals as files of other programs: text tables, Parquet, MATLAB."""
