"""The blind benchmark: recordings that conceal what acts in them, diagnosed and scored."""
