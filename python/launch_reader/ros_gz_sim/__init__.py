"""The names of ros_gz_sim."""
