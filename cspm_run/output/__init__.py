"""What commands print and write: text, tables and JSON."""
