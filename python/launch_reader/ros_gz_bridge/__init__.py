"""The names of ros_gz_bridge."""
