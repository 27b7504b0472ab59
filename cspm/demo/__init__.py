"""A demonstration: an effect is concealed in a machine, guessed, diagnosed and revealed."""
