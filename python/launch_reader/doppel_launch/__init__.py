"""Reads launch files of ROS 2 and ROS 1 without ROS, and starts nothing.

The modules `launch`, `launch_ros` and their companions beside this package have the names that launch files import.
Their actions are visited once, in order, and recorded with the line that made them (`record.py`). Packages and xacro
come from doppel, which runs this program (`host.py`).
"""
