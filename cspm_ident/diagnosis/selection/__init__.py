"""Selection of the effects and elements that explain the residuals, with alternatives."""
