"""Messages sent and taken by functions of rcl itself, without rclpy's objects in between."""
