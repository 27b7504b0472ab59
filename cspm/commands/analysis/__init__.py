"""The commands that analyse a machine."""
