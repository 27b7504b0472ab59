"""A cable-suspended test-bed in software: simulate it, record it, and say what the model lacks."""
