"""What each command does: reads inputs, calls the package that works, prints and writes."""
