"""What recordings themselves show, before any model is fitted to them."""
