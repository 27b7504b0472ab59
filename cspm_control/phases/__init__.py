"""The stages as compiled phases of a step, which a loop calls without Python in between."""
