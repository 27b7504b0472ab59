"""The model: kinematics, bar, cables, winches, sensors, effects, plant."""
