"""Runs, replays and driver checks on a ROS 2 graph."""
