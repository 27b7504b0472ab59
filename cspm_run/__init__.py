"""Runs in one process without ROS: assembled from a scenario, stepped, recorded, repeated."""
