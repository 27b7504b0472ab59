"""Playing recordings to a ROS 2 graph: in time, or in lockstep and compared."""
