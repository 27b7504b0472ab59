"""Bags as streams of ROS 2 messages: rosbag2 (MCAP, sqlite3) and ROS 1, read without ROS."""

from cspm_msgs_py.bag.run import BagMessage as BagMessage
from cspm_msgs_py.bag.stream import BagStream as BagStream
from cspm_msgs_py.bag.stream import BagTopic as BagTopic
from cspm_msgs_py.bag.stream import open_bag as open_bag
