"""The substitutions of launch_ros."""

__path__ = []  # modules below it are aliases

import os

from launch.substitution import Substitution
from launch.utilities import perform_substitutions

from doppel_launch.host import share_folder
from doppel_launch.record import RECORDER
from doppel_launch.unknown import unknown_attribute


class FindPackage(Substitution):
    def __init__(self, package):
        self.package = package
        if isinstance(package, str):
            RECORDER.look_up(package, self.place)

    def __truediv__(self, other):
        from launch.substitutions import PathJoinSubstitution

        return PathJoinSubstitution([self, other])

    def find(self, package_name):
        return share_folder(package_name, self.place)

    def perform(self, context):
        return share_folder(perform_substitutions(context, self.package), self.place)


class FindPackageShare(FindPackage):
    pass


class FindPackagePrefix(FindPackage):
    """The share folder stands for all folders of a package: that of a source has launch and config as well."""


class ExecutableInPackage(Substitution):
    def __init__(self, executable, package, **_named):
        self.executable, self.package = executable, package

    def perform(self, context):
        package = perform_substitutions(context, self.package)
        return os.path.join(share_folder(package, self.place), perform_substitutions(context, self.executable))


class Parameter(Substitution):
    def __init__(self, name, *, default=None):
        self.name, self.default = name, default

    def perform(self, context):
        name = perform_substitutions(context, self.name)
        for key, value in reversed(context.launch_configurations.get("global_params", ())):
            if key == name:
                return str(value)
        return "" if self.default is None else perform_substitutions(context, self.default)


__getattr__ = unknown_attribute(__name__)
