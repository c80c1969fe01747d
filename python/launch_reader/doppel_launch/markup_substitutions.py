"""$(name arguments) in XML and YAML launch files, of ROS 2 and ROS 1."""

import os
import shlex
import shutil

from launch.substitutions import _equal, is_true, run_command

from .host import share_folder
from .record import RECORDER, LaunchError

MAX_NESTING = 20


def _closing(text, begin, place):
    """The index of the parenthesis that closes the one before `begin`; parentheses in quotes do not count."""
    depth, quote = 1, ""
    for i in range(begin, len(text)):
        c = text[i]
        if quote:
            quote = "" if c == quote and text[i - 1] != "\\" else quote
        elif c in "'\"" and _quoted_until(text, i) is not None:
            quote = c
        elif c == "(":
            depth += 1
        elif c == ")":
            depth -= 1
            if depth == 0:
                return i
    raise LaunchError(f"'{text}' has a $( without its )", place)


def _quoted_until(text, begin):
    end = text.find(text[begin], begin + 1)
    return None if end < 0 else end


class MarkupSubstitutions:
    """The texts of one file."""

    def __init__(self, context, file, ros1):
        self.context, self.file, self.ros1 = context, file, ros1

    def text(self, value, place, nesting=0):
        """`value` with all substitutions performed."""
        if isinstance(value, list):
            return [self.text(one, place, nesting) for one in value]
        if nesting > MAX_NESTING:
            raise LaunchError("substitutions are nested too deeply", place)
        out, position = "", 0
        while True:
            begin = value.find("$(", position)
            if begin < 0:
                return out + value[position:]
            if begin > 0 and value[begin - 1] == "\\":
                out += value[position:begin - 1] + "$("
                position = begin + 2
                continue
            end = _closing(value, begin + 2, place)
            out += value[position:begin]
            out += self._perform(value[begin + 2:end], place, nesting + 1)
            position = end + 1

    def _perform(self, inner, place, nesting):
        name, _, rest = inner.strip().partition(" ")
        rest = rest.strip()
        if name == "eval" and self.ros1:
            return self._eval1(rest, place)
        inner_text = self.text(rest, place, nesting)
        if name in ("eval", "command"):
            quoted = len(inner_text) > 1 and inner_text[0] == inner_text[-1] and inner_text[0] in "'\""
            first = inner_text
            if name == "command":
                words = shlex.split(inner_text)
                first = words[0] if quoted or (words and " " in words[0]) else inner_text
                return run_command(shlex.split(first), place)
            return self._eval(inner_text[1:-1] if quoted else inner_text, place)
        words = [w for w in shlex.split(inner_text)] if inner_text else []
        function = getattr(self, "_" + name.replace("-", "_").replace("find", "find", 1), None)
        if function is None:
            raise LaunchError(f"'$({name} ...)' is not known", place)
        try:
            return function(place, *words)
        except TypeError as error:
            raise LaunchError(f"'$({inner})' has the wrong number of arguments", place) from error

    def _var(self, place, name, default=None):
        values = self.context.launch_configurations
        if name in values:
            return values[name]
        if default is not None:
            return default
        raise LaunchError(f"the argument '{name}' does not exist", place, f"declare it: <arg name=\"{name}\"/>")

    _arg = _var

    def _env(self, place, name, *default):
        if name in self.context.environment:
            return self.context.environment[name]
        if default:
            return " ".join(default)
        if RECORDER.survey:
            RECORDER.assumed = True
            return ""
        raise LaunchError(f"environment variable '{name}' is not set", place, f"export {name}=...")

    def _optenv(self, _place, name, *default):
        return self.context.environment.get(name, " ".join(default))

    def _find_pkg_share(self, place, name):
        return share_folder(name, place)

    _find = _find_pkg_prefix = _find_pkg_share

    def _find_exec(self, _place, name):
        return shutil.which(name) or name

    def _exec_in_package(self, place, executable, package):
        return os.path.join(share_folder(package, place), executable)

    _exec_in_pkg = _exec_in_package

    def _dirname(self, _place):
        return os.path.dirname(self.file)

    def _filename(self, _place):
        return self.file

    def _anon(self, _place, name):
        return name

    def _not(self, place, value):
        return str(not is_true(value, place)).lower()

    def _and(self, place, a, b):
        return str(is_true(a, place) and is_true(b, place)).lower()

    def _or(self, place, a, b):
        return str(is_true(a, place) or is_true(b, place)).lower()

    def _any(self, place, *values):
        return str(any(is_true(one, place) for one in values)).lower()

    def _all(self, place, *values):
        return str(all(is_true(one, place) for one in values)).lower()

    def _eq(self, _place, a, b):
        return str(_equal(a, b)).lower()

    _equals = _eq

    def _ne(self, _place, a, b):
        return str(not _equal(a, b)).lower()

    _not_equals = _ne

    def _if(self, place, condition, then="", otherwise=""):
        return then if is_true(condition, place) else otherwise

    def _file_content(self, _place, path):
        with open(path, encoding="utf-8") as file:
            return file.read()

    def _eval(self, expression, place):
        import math

        try:
            return str(eval(expression, {}, dict(vars(math), math=math)))
        except Exception as error:  # whatever the expression throws
            raise LaunchError(f"the expression \"{expression}\" fails: {error}", place) from error

    def _eval1(self, expression, place):
        """roslaunch: arguments are variables, with the type that their text has."""
        import math

        def arg(name):
            return _typed1(self._var(place, name))

        names = dict(vars(math), arg=arg, find=lambda name: share_folder(name, place),
                     dirname=lambda: os.path.dirname(self.file),
                     env=lambda name: self._env(place, name),
                     optenv=lambda name, default="": self._optenv(place, name, default), anon=lambda name: name,
                     true=True, false=False)
        names.update({k: _typed1(v) for k, v in self.context.launch_configurations.items() if isinstance(v, str)})
        try:
            return str(eval(expression, {}, names))
        except LaunchError:
            raise
        except Exception as error:  # whatever the expression throws
            raise LaunchError(f"the expression \"{expression}\" fails: {error}", place) from error


def _typed1(text):
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text
