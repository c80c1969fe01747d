"""The configuration of a MoveIt package: files by their usual names in its folder `config`."""

from .builder import MoveItConfigs, MoveItConfigsBuilder  # noqa: F401

from doppel_launch.unknown import unknown_attribute

HAS_STAND_INS = True
__getattr__ = unknown_attribute(__name__)
