"""What runs it all: scenario runner, recorder, command line."""
