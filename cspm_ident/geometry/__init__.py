"""Self-calibration: where cables begin and end, from poses and encoders."""
