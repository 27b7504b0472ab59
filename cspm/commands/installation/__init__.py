"""Commands about the installation and its files."""
