"""Tables of values fitted to residuals that no effect of the catalogue explains."""
