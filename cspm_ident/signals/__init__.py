"""What a recording measured, as arrays: read, smoothed, put on a common time axis."""
