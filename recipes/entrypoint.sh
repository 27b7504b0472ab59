#!/bin/bash
# Sources ROS and the overlay, then becomes what is asked for.
set -e
source /opt/ros/jazzy/setup.bash
source /overlay/install/setup.bash
exec "$@"
