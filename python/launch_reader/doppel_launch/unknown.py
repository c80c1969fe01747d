"""Names that are not here: what a launch file makes with them is recorded by name and line, and left out."""

import importlib.machinery
import sys
import types

from .host import HOST
from .record import RECORDER, user_place


class Unknown:
    """An object of a class that is not here. As an action it is recorded, as a substitution it is empty."""

    def __init__(self, name, place):
        self.unknown_name, self.place = name, place
        self.condition = None

    def __call__(self, *_arguments, **named):
        # A decorator or a factory.
        out = Unknown(self.unknown_name, user_place())
        out.condition = named.get("condition")
        return out

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Unknown(f"{self.unknown_name}.{name}", user_place())

    def perform(self, _context):
        RECORDER.warn("launch.unknown_name", self.place,
                      f"'{self.unknown_name}' is not known to doppel; its text is empty")
        return ""

    def __iter__(self):
        return iter(())

    def __getitem__(self, key):
        return Unknown(f"{self.unknown_name}[{key!r}]", user_place())

    def __len__(self):
        return 0

    def __bool__(self):
        return True

    def __fspath__(self):
        return ""

    def __str__(self):
        return ""

    def __add__(self, other):
        return other

    __radd__ = __add__
    __truediv__ = __add__


class _UnknownType(type):
    """Constants and functions of an unknown class are unknown, too."""

    def __getattr__(cls, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Unknown(f"{cls.unknown_name}.{name}", user_place())


def unknown_class(module, name):
    """A class whose objects are Unknown; others may derive from it."""

    def make(cls, *_arguments, **named):
        if cls is not made:
            return object.__new__(cls)
        out = Unknown(f"{module}.{name}", user_place())
        out.condition = named.get("condition")
        return out

    # `except` accepts classes of exceptions only.
    if name.endswith(("Error", "Exception")):
        return type(name, (Exception,), {"unknown_name": f"{module}.{name}"})
    made = _UnknownType(name, (), {"__new__": make, "__init__": lambda self, *a, **k: None, "unknown_name": f"{module}.{name}"})
    return made


def unknown_attribute(module):
    """The `__getattr__` of a module whose other names are unknown."""

    def get(name):
        if name.startswith("__"):
            raise AttributeError(name)
        return unknown_class(module, name)

    return get


class _StandIn(types.ModuleType):
    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return unknown_class(self.__name__, name)


def _asked_by_user():
    """False for an import inside of Python's own library, which tries modules that need not exist."""
    frame = sys._getframe(1)
    while frame is not None:
        file = frame.f_code.co_filename
        if not file.startswith("<frozen") and file != __file__:
            return "/lib/python3" not in file
        frame = frame.f_back
    return True


def _alias_of(fullname):
    """launch.actions.declare_launch_argument has the names of launch.actions."""
    parent = sys.modules.get(fullname.rpartition(".")[0])
    names = ("launch", "launch_ros", "ament_index_python", "launch_xml", "launch_yaml", "moveit_configs_utils")
    is_own = parent is not None and parent.__name__.split(".")[0] in names
    return parent if is_own and not isinstance(parent, _StandIn) else None


class _Alias:
    def __init__(self, module):
        self._module = module

    def create_module(self, spec):
        out = types.ModuleType(spec.name)
        out.__dict__.update({k: v for k, v in vars(self._module).items() if not k.startswith("__")})
        out.__getattr__ = getattr(self._module, "__getattr__", unknown_attribute(spec.name))
        out.__path__ = []
        return out

    def exec_module(self, module):
        """It is complete."""


class PackageFinder:
    """Python modules of ROS packages in source folders, and stand-ins for all other missing modules.

    It comes last in sys.meta_path, so it is asked only for modules that are nowhere else.
    """

    def find_spec(self, fullname, _path, _target=None):
        top = fullname.split(".")[0]
        if top.startswith("_") or top in sys.stdlib_module_names or not _asked_by_user():
            return None
        own = _alias_of(fullname)
        if own is not None:
            return importlib.machinery.ModuleSpec(fullname, _Alias(own))
        folder = HOST.package(top) if "." not in fullname else None
        if folder:
            for place in (folder, f"{folder}/src", f"{folder}/scripts"):
                found = importlib.machinery.PathFinder.find_spec(fullname, [place])
                if found is not None and found.loader is not None:
                    return found
        parent = sys.modules.get(fullname.rpartition(".")[0])
        if "." in fullname and not isinstance(parent, _StandIn) and parent is not None and not getattr(
                parent, "HAS_STAND_INS", False):
            return None
        return importlib.machinery.ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec):
        if "." not in spec.name:
            RECORDER.warn("launch.unknown_module", user_place(),
                          f"the Python module '{spec.name}' is not on this machine; what it makes is not started",
                          f"put the package '{spec.name}' beside this one, if it describes the robot")
        return _StandIn(spec.name)

    def exec_module(self, module):
        module.__path__ = []
