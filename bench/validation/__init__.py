"""What is measured rather than tested: over many runs, whole sets, or by generating pages anew."""
