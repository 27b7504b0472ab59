"""Motor torques computed ahead from references: friction, winch inertia and cable stretch."""
