"""A diagnosis in sentences, as `diagnosis.json`, as a page and as an improved test-bed file."""
