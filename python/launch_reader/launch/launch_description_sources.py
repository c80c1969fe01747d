"""Launch files as sources of descriptions."""

__path__ = []  # modules below it are aliases

import importlib.machinery
import importlib.util
import os
import sys

from doppel_launch.bounds import require_regular
from doppel_launch.record import RECORDER, LaunchError, executed_python, place_of_error, user_place
from doppel_launch.unknown import unknown_attribute

from .launch_description import LaunchDescription
from .utilities import perform_substitutions
from .visit import visit


def load_python_launch_file_as_module(path):
    """The module of a launch file; its folder is on the module path, as with `python3 FILE`."""
    name = "launch_file_" + "".join(c if c.isalnum() else "_" for c in path)
    loader = importlib.machinery.SourceFileLoader(name, path)
    spec = importlib.util.spec_from_loader(name, loader)
    module = importlib.util.module_from_spec(spec)
    folder = os.path.dirname(path)
    sys.path.append(folder)
    try:
        loader.exec_module(module)
    finally:
        sys.path.remove(folder)
    return module


def get_launch_description_from_python_launch_file(path):
    module = load_python_launch_file_as_module(path)
    function = getattr(module, "generate_launch_description", None)
    if function is None:
        raise LaunchError("there is no function generate_launch_description()", (path, 1),
                          "a launch file of ROS 2 has one")
    return function()


def visit_file(path, context):
    """Any launch file."""
    from doppel_launch.frontends import visit_markup

    path = os.path.abspath(path)
    RECORDER.read_file(path)
    context.locals.__dict__["current_launch_file_path"] = path
    context.locals.__dict__["current_launch_file_directory"] = os.path.dirname(path)
    require_regular(path)
    if not path.endswith(".py"):
        visit_markup(path, context)
        return
    try:
        with executed_python():
            visit(get_launch_description_from_python_launch_file(path), context)
    except (LaunchError, SystemExit):
        raise
    except Exception as error:  # whatever the user's code throws
        place = place_of_error(error)
        text = str(error) if isinstance(error, (RuntimeError, OSError)) and str(error) else (
            f"{type(error).__name__}: {error}")
        raise LaunchError(text, place if place[0] else (path, 1)) from error


class LaunchDescriptionSource:
    def __init__(self, launch_description=None, location="", method=""):
        self.place = user_place()
        self.launch_description = launch_description
        self.path = location

    @property
    def location(self):
        return self.path

    def performed_path(self, context):
        return "" if self.launch_description is not None else perform_substitutions(context, self.path)

    def get_launch_description(self, context):
        if self.launch_description is not None:
            return self.launch_description
        return get_launch_description_from_python_launch_file(self.performed_path(context))

    def visit(self, context):
        if self.launch_description is not None:
            visit(self.launch_description, context)
        else:
            visit_file(self.performed_path(context), context)


class AnyLaunchDescriptionSource(LaunchDescriptionSource):
    def __init__(self, launch_file_path):
        if isinstance(launch_file_path, LaunchDescription):
            super().__init__(launch_description=launch_file_path)
        else:
            super().__init__(location=launch_file_path)
        self.place = user_place()


class PythonLaunchDescriptionSource(AnyLaunchDescriptionSource):
    pass


class FrontendLaunchDescriptionSource(AnyLaunchDescriptionSource):
    pass


class XMLLaunchDescriptionSource(AnyLaunchDescriptionSource):
    pass


class YAMLLaunchDescriptionSource(AnyLaunchDescriptionSource):
    pass


__getattr__ = unknown_attribute(__name__)
