"""From a wanted wrench on the bar to cable tensions within their limits."""
