"""Which effects on which elements explain the residuals, and what else would."""
