"""Parts of the scenario's `control`: force controllers, tension distribution, values per cable."""
