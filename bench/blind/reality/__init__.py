"""Machines as they might be: physics and sensors written apart from the model that judges them."""
