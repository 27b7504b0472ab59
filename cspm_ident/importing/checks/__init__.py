"""What looks wrong in an import: nothing is changed by it."""
