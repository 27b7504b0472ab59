"""Other people's ways of finding what a model lacks, on the same residuals."""
