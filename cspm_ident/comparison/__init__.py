"""A recording beside its simulation from measured inputs."""
