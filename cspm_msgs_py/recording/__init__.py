"""Recordings: rosbag2 folders with an MCAP file, written and read without ROS."""
