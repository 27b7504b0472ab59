"""The contract: topics, plain data types, test-bed and scenario files, recordings."""
