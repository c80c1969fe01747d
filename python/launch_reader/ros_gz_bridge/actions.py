"""The action of ros_gz_bridge."""

from launch_ros.actions import Node

from doppel_launch.unknown import unknown_attribute


class RosGzBridge(Node):
    def __init__(self, *, bridge_name="ros_gz_bridge", config_file="", condition=None, **_named):
        super().__init__(package="ros_gz_bridge", executable="bridge_node", name=bridge_name,
                         parameters=[{"config_file": config_file}], condition=condition)


__getattr__ = unknown_attribute(__name__)
