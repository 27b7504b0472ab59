"""Recordings: rosbag2 folders with an MCAP file, written and read without ROS."""

from cspm_msgs_py.recording.difference import Difference as Difference
from cspm_msgs_py.recording.difference import first_difference as first_difference
from cspm_msgs_py.recording.overview import Overview as Overview
from cspm_msgs_py.recording.overview import TopicOverview as TopicOverview
from cspm_msgs_py.recording.overview import overview as overview
from cspm_msgs_py.recording.reader import Recording as Recording
from cspm_msgs_py.recording.recover import RecoveryReport as RecoveryReport
from cspm_msgs_py.recording.recover import recover as recover
from cspm_msgs_py.recording.rows import Rows as Rows
from cspm_msgs_py.recording.writer import RecordingWriter as RecordingWriter
