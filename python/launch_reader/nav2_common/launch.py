"""Files that nav2_common rewrites for one start."""

import os

from launch.substitution import Substitution
from launch.substitutions import LaunchConfiguration, is_true
from launch.utilities import perform_substitutions, typed_value

from doppel_launch.host import HOST
from doppel_launch.record import RECORDER
from doppel_launch.unknown import unknown_attribute


class RewrittenYaml(Substitution):
    """A parameter file with other values, under a root key."""

    def __init__(self, source_file, param_rewrites=None, root_key=None, key_rewrites=None, convert_types=False,
                 value_rewrites=None):
        self.source_file, self.param_rewrites, self.root_key = source_file, param_rewrites or {}, root_key
        self.convert_types = convert_types

    def perform(self, context):
        import yaml

        path = perform_substitutions(context, self.source_file)
        if RECORDER.survey or not os.path.exists(path):
            return path
        with open(path, encoding="utf-8") as file:
            values = yaml.safe_load(file) or {}
        for name, value in self.param_rewrites.items():
            _rewrite(values, name, typed_value(perform_substitutions(context, value)))
        root = perform_substitutions(context, self.root_key) if self.root_key is not None else ""
        if root:
            values = {root: values}
        return HOST.write_file(os.path.basename(path), yaml.safe_dump(values, sort_keys=False))


def _rewrite(values, name, value):
    """Every key of this name; a name with dots is a path."""
    for key in list(values):
        if key == name:
            values[key] = value
        elif isinstance(values[key], dict):
            rest = name[len(key) + 1:] if name.startswith(f"{key}.") else name
            _rewrite(values[key], rest, value)


class ReplaceString(Substitution):
    def __init__(self, source_file, replacements, condition=None):
        self.source_file, self.replacements, self.condition = source_file, replacements, condition

    def perform(self, context):
        path = perform_substitutions(context, self.source_file)
        if self.condition is not None and not self.condition.evaluate(context) or not os.path.exists(path):
            return path
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for name, value in self.replacements.items():
            text = text.replace(name, perform_substitutions(context, value))
        return HOST.write_file(os.path.basename(path), text)


class HasNodeParams(Substitution):
    def __init__(self, source_file, node_name):
        self.source_file, self.node_name = source_file, node_name

    def perform(self, context):
        import yaml

        path = perform_substitutions(context, self.source_file)
        if not os.path.exists(path):
            return "False"
        with open(path, encoding="utf-8") as file:
            return str(self.node_name in (yaml.safe_load(file) or {}))


class LaunchConfigAsBool(LaunchConfiguration):
    """A configuration whose text is True or False."""

    def __init__(self, name):
        super().__init__(name)

    def perform(self, context):
        return str(is_true(super().perform(context), self.place))


__getattr__ = unknown_attribute(__name__)
