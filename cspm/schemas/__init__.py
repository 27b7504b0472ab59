"""JSON Schemas of the files that cspm reads and writes."""
