"""From recordings and a test-bed file to findings: which physics the file lacks, and how sure."""
