"""MuJoCo in the place of the plant: what its steps and a closed loop around it cost."""
