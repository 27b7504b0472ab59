"""Controllers of bar motion and cable tension, observers, and the reference governor."""
