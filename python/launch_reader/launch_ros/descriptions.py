"""Nodes that are loaded into a container."""

__path__ = []  # modules below it are aliases

from launch.utilities import perform_substitutions, perform_text

from doppel_launch.record import user_place
from doppel_launch.unknown import unknown_attribute

from .names import remap_records
from .parameter_descriptions import Parameter, ParameterFile, ParameterValue, parameter_records  # noqa: F401


class ComposableNode:
    def __init__(self, *, package, plugin, name=None, namespace=None, parameters=None, remappings=None,
                 extra_arguments=None, condition=None):
        self.package, self.plugin, self.name, self.namespace = package, plugin, name, namespace
        self.parameters, self.remappings, self.condition = parameters, remappings, condition
        self.place = user_place()

    def described(self, context):
        if self.condition is not None and not self.condition.evaluate(context):
            return None
        out = {"package": perform_substitutions(context, self.package),
               "plugin": perform_substitutions(context, self.plugin),
               "name": perform_text(context, self.name) or "",
               "namespace": perform_text(context, self.namespace) or "",
               "parameters": parameter_records(context, self.parameters),
               "remappings": remap_records(context, self.remappings),
               "file": self.place[0], "line": self.place[1]}
        return {k: v for k, v in out.items() if v not in ("", [])}


__getattr__ = unknown_attribute(__name__)
