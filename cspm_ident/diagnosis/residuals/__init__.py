"""Residuals of a recording: measured minus modelled, per winch, cable, bar and sensor."""
