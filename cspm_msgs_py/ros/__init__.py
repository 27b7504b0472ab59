"""The contract on ROS 2: nodes, quality of service and the lockstep handshake. Needs rclpy."""
