"""What is installed: the libraries of extras, what the package depends on, and its licences."""
