"""Parameters from files, as launch_param_builder reads them."""

import os
from pathlib import Path

import xacro
from launch_ros.parameter_descriptions import ParameterValue

from doppel_launch.host import share_folder
from doppel_launch.record import RECORDER
from doppel_launch.unknown import unknown_attribute


class ParameterBuilderFileNotFoundError(KeyError):
    """As in launch_param_builder."""


def get_path(path):
    return Path(path)


def load_yaml(file_path):
    """The values of a file; none where there is no file."""
    import yaml

    if not os.path.exists(file_path):
        return {}
    with open(file_path, encoding="utf-8") as file:
        return yaml.safe_load(file) or {}


def load_xacro(file_path, mappings=None):
    path = str(file_path)
    if path.endswith(".xacro"):
        return xacro.process(path, mappings=mappings)
    with open(path, encoding="utf-8") as file:
        return RECORDER.description(file.read(), path, {})


class ParameterBuilder:
    def __init__(self, package_name):
        self._package_path = Path(share_folder(package_name))
        self._parameters = {}

    def yaml(self, file_path, parameter_namespace=None):
        values = load_yaml(self._package_path / file_path)
        self._parameters.update({parameter_namespace: values} if parameter_namespace else values)
        return self

    def file_parameter(self, parameter_name, file_path):
        self._parameters[parameter_name] = load_xacro(self._package_path / file_path)
        return self

    def xacro_parameter(self, parameter_name, file_path, mappings=None):
        self._parameters[parameter_name] = load_xacro(self._package_path / file_path, mappings)
        return self

    def parameter(self, parameter_name, parameter_value):
        self._parameters[parameter_name] = parameter_value
        return self

    def to_dict(self):
        return self._parameters


__all__ = ["ParameterBuilder", "ParameterValue", "get_path", "load_xacro", "load_yaml"]
__getattr__ = unknown_attribute(__name__)
