"""What looks wrong in signals: each check once, on arrays with time and the machine's file."""
