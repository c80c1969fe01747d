"""The substitutions of launch."""

__path__ = []  # modules below it are aliases

import os
import shutil

from doppel_launch.bounds import file_text
from doppel_launch.host import HOST
from doppel_launch.record import RECORDER, LaunchError
from doppel_launch.texts import split_words
from doppel_launch.unknown import unknown_attribute

from .substitution import Substitution
from .utilities import normalize_to_list_of_substitutions, perform_substitutions


class SubstitutionFailure(RuntimeError):
    """As in launch."""


class TextSubstitution(Substitution):
    def __init__(self, *, text):
        self.text = text

    def perform(self, context):
        return self.text


class LaunchConfiguration(Substitution):
    def __init__(self, variable_name, *, default=None):
        self.variable_name = normalize_to_list_of_substitutions(variable_name)
        self._default = None if default is None else default

    @property
    def default(self):
        return self._default

    def perform(self, context):
        name = perform_substitutions(context, self.variable_name)
        if name in context.launch_configurations:
            return context.launch_configurations[name]
        if self._default is None:
            raise LaunchError(
                f"launch configuration '{name}' does not exist", self.place,
                f"declare it with DeclareLaunchArgument('{name}', ...) before it is used")
        if isinstance(self._default, (bool, int, float)):
            return str(self._default)
        return perform_substitutions(context, self._default)

    # Comparisons that launch adds in Kilted and later.
    def __eq__(self, other):
        if isinstance(other, (str, bool, int, float)):
            return EqualsSubstitution(self, str(other))
        return self is other

    def __ne__(self, other):
        if isinstance(other, (str, bool, int, float)):
            return NotEqualsSubstitution(self, str(other))
        return self is not other

    __hash__ = Substitution.__hash__


class PathSubstitution(Substitution):
    """A path whose parts are joined with /."""

    def __init__(self, path):
        self.parts = [path]

    def __truediv__(self, other):
        out = PathSubstitution(self.parts[0])
        out.parts = [*self.parts, other]
        return out

    def perform(self, context):
        return os.path.join(*[perform_substitutions(context, part) for part in self.parts])


class PathJoinSubstitution(Substitution):
    def __init__(self, substitutions):
        self.substitutions = list(substitutions)

    def __truediv__(self, other):
        return PathJoinSubstitution([*self.substitutions, other])

    def perform(self, context):
        return os.path.join(*[perform_substitutions(context, one) for one in self.substitutions])


class StringJoinSubstitution(Substitution):
    def __init__(self, substitutions, delimiter=""):
        self.substitutions, self.delimiter = list(substitutions), delimiter

    def perform(self, context):
        delimiter = perform_substitutions(context, self.delimiter)
        return delimiter.join(perform_substitutions(context, one) for one in self.substitutions)


class PythonExpression(Substitution):
    def __init__(self, expression, python_modules=("math",)):
        self.expression, self.modules = expression, python_modules

    def perform(self, context):
        text = perform_substitutions(context, self.expression)
        names = {}
        modules = self.modules
        if isinstance(modules, (str, Substitution)):
            modules = [modules]
        for module in modules:
            name = perform_substitutions(context, module)
            loaded = __import__(name)
            names[name] = loaded
            if name == "math":
                names.update({k: v for k, v in vars(loaded).items() if not k.startswith("_")})
        try:
            return str(eval(text, {}, names))
        except Exception as error:  # whatever the expression throws
            raise LaunchError(f"the expression \"{text}\" fails: {error}", self.place) from error


def run_command(words, place):
    """The output of a command whose output can be known without starting it: xacro and cat."""
    for starter in (["rosrun", "xacro"], ["ros2", "run", "xacro"], ["python3"], ["python"]):
        if words[:len(starter)] == starter and len(words) > len(starter):
            if os.path.basename(words[len(starter)]).startswith("xacro"):
                words = words[len(starter):]
    # A script that sets variables, and starts xacro.
    inner = next((i for i, word in enumerate(words) if os.path.basename(word) in ("xacro", "xacro.py")), 0)
    if inner > 0:
        RECORDER.warn("launch.command", place, f"the script '{words[0]}' was not run, only xacro after it",
                      "export the variables that it sets, where the description needs them")
        words = words[inner:]
    program = os.path.basename(words[0]) if words else ""
    if program in ("xacro", "xacro.py"):
        names = [w for w in words[1:] if ":=" not in w and not w.startswith("-")]
        arguments = dict(w.split(":=", 1) for w in words[1:] if ":=" in w)
        if not names:
            raise LaunchError("xacro without a file", place)
        file = names[-1]
        RECORDER.expand(file, arguments, place, "Command")
        try:
            text, source = HOST.expand(file, arguments)
        except RuntimeError as error:
            raise LaunchError(str(error), place) from error
        return RECORDER.description(text, source, arguments)
    if program == "cat" and len(words) == 2:
        return file_text(words[1], place)
    RECORDER.warn("launch.command", place, f"the command '{' '.join(words)}' was not run; its output is empty",
                  "doppel runs xacro and cat while it reads a launch file")
    return ""


class Command(Substitution):
    def __init__(self, command, *, on_stderr="fail"):
        self.command = command

    def perform(self, context):
        text = perform_substitutions(context, self.command)
        return run_command(split_words(text, self.place), self.place)


class FindExecutable(Substitution):
    def __init__(self, *, name):
        self.name = name

    def perform(self, context):
        name = perform_substitutions(context, self.name)
        return shutil.which(name) or name


class EnvironmentVariable(Substitution):
    def __init__(self, name, *, default_value=None):
        self.name, self.default_value = name, default_value

    def perform(self, context):
        name = perform_substitutions(context, self.name)
        if name in context.environment:
            return context.environment[name]
        if self.default_value is None and RECORDER.survey:
            RECORDER.assumed = True
            return ""
        if self.default_value is None:
            raise LaunchError(f"environment variable '{name}' is not set", self.place, f"export {name}=...")
        return perform_substitutions(context, self.default_value)


class ThisLaunchFile(Substitution):
    def perform(self, context):
        return context.locals.current_launch_file_path


class ThisLaunchFileDir(Substitution):
    def perform(self, context):
        return context.locals.current_launch_file_directory


class LaunchLogDir(Substitution):
    def perform(self, context):
        return HOST.folder


class LocalSubstitution(Substitution):
    def __init__(self, expression, description=None):
        self.expression = expression

    def perform(self, context):
        value = context.locals
        for name in self.expression.split("."):
            value = getattr(value, name)
        return str(value)


class AnonName(Substitution):
    def __init__(self, name):
        self.name = name

    def perform(self, context):
        # A fixed name instead of a random one: the same file gives the same names.
        return perform_substitutions(context, self.name)


def is_true(text, place):
    """As launch reads a condition."""
    word = text.strip().lower()
    if word in ("true", "1", "on", "yes"):
        return True
    if word in ("false", "0", "off", "no"):
        return False
    raise LaunchError(f"'{text}' is neither true nor false", place)


class _Logic(Substitution):
    def __init__(self, *operands, **named):
        self.operands = [*operands, *named.values()]

    def values(self, context):
        return [is_true(perform_substitutions(context, one), self.place) for one in self.operands]


class NotSubstitution(_Logic):
    def perform(self, context):
        return str(not self.values(context)[0]).lower()


class AndSubstitution(_Logic):
    def perform(self, context):
        return str(all(self.values(context))).lower()


class OrSubstitution(_Logic):
    def perform(self, context):
        return str(any(self.values(context))).lower()


class AllSubstitution(AndSubstitution):
    pass


class AnySubstitution(OrSubstitution):
    pass


def _equal(left, right):
    if left == right:
        return True
    truth = {"true": "1", "on": "1", "yes": "1", "false": "0", "off": "0", "no": "0"}
    left, right = (truth.get(one.strip().lower(), one) for one in (left, right))
    if left == right:
        return True
    try:
        return float(left) == float(right)
    except ValueError:
        return False


class EqualsSubstitution(Substitution):
    def __init__(self, left, right):
        self.left, self.right = left, right

    def perform(self, context):
        left, right = (perform_substitutions(context, one) for one in (self.left, self.right))
        return str(_equal(left, right)).lower()


class NotEqualsSubstitution(EqualsSubstitution):
    def perform(self, context):
        return "false" if super().perform(context) == "true" else "true"


class IfElseSubstitution(Substitution):
    def __init__(self, condition, if_value="", else_value=""):
        self.condition, self.if_value, self.else_value = condition, if_value, else_value

    def perform(self, context):
        chosen = is_true(perform_substitutions(context, self.condition), self.place)
        return perform_substitutions(context, self.if_value if chosen else self.else_value)


class BooleanSubstitution(Substitution):
    def __init__(self, value):
        self.value = value

    def perform(self, context):
        return str(is_true(perform_substitutions(context, self.value), self.place)).lower()


class FileContent(Substitution):
    def __init__(self, path):
        self.path = path

    def perform(self, context):
        path = perform_substitutions(context, self.path)
        return file_text(path, self.place)


__getattr__ = unknown_attribute(__name__)
