"""Nodes and processes of a run over real ROS 2 topics, in lockstep or in real time."""
