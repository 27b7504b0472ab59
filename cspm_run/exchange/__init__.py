"""Plants as other simulators load them."""
