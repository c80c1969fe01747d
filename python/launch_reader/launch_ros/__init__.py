"""The names of the package `launch_ros` of ROS 2, which record instead of starting."""

HAS_STAND_INS = True

from . import actions, descriptions, event_handlers, events, parameter_descriptions, substitutions  # noqa: F401

from doppel_launch.unknown import unknown_attribute

__getattr__ = unknown_attribute(__name__)
