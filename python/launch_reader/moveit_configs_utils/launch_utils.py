"""Small things for launch files of MoveIt packages."""

from launch.actions import DeclareLaunchArgument
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from doppel_launch.unknown import unknown_attribute


class DeclareBooleanLaunchArg(DeclareLaunchArgument):
    def __init__(self, name, *, default_value=False, description=None, **named):
        super().__init__(name, default_value=str(default_value), description=description, **named)


def add_debuggable_node(ld, package, executable, condition_name="debug", commands_file=None, extra_debug_args=None,
                        **named):
    ld.add_action(Node(package=package, executable=executable, **named))


def get_path(value):
    return ParameterValue(value, value_type=str)


__getattr__ = unknown_attribute(__name__)
