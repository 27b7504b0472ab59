"""Least squares of residuals on the effects' regressors, with errors for coloured residuals."""
