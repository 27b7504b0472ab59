"""The node that shows a run to RViz, Foxglove and their like."""
