"""Commands about the catalogue of effects."""
