"""A whole machine identified by output error: bar, cables and damping from recordings."""
