"""Encoders against measured poses: cable lengths without torque or tension."""
