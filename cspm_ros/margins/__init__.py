"""How late commands may come, and how late they do on this machine."""
