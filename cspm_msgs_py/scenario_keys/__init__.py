"""Parts of the scenario file beside `control`: bodies, and what happens during a run."""
