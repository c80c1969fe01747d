"""The builder under the name of its module."""

from .builder import MoveItConfigs, MoveItConfigsBuilder  # noqa: F401
