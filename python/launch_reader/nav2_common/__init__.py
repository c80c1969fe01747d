"""The names of nav2_common."""
