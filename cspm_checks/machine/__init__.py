"""What contradicts the machine: encoders, poses, load cells and torques against each other."""
