"""$(name arguments) in XML and YAML launch files, of ROS 2 and ROS 1."""

import inspect
import os
import shutil

from launch.substitutions import _equal, is_true, run_command

from .bounds import file_text
from .host import share_folder
from .record import RECORDER, LaunchError
from .texts import split_words

MAX_NESTING = 20

# Each is a method of MarkupSubstitutions, beside others that no launch file may call.
_NAMES = frozenset((
    "var", "arg", "env", "optenv", "find_pkg_share", "find_pkg_prefix", "find", "find_exec", "exec_in_package", "exec_in_pkg", "dirname",
    "filename", "anon", "not", "and", "or", "any", "all", "eq", "equals", "ne", "not_equals", "if", "file_content"))


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


def _accepts(function, count):
    """Whether a method has so many parameters behind `self` and `place`."""
    code = function.__code__
    most = code.co_argcount - 2
    return count >= most - len(function.__defaults__ or ()) and (count <= most or code.co_flags & inspect.CO_VARARGS)


def _quoted_until(text, begin):
    end = text.find(text[begin], begin + 1)
    return None if end < 0 else end


class MarkupSubstitutions:
    """The texts of one file."""

    def __init__(self, context, file, ros1):
        self.context, self.file, self.ros1 = context, file, ros1

    def text(self, value, place, nesting=0):
        """`value` with all substitutions performed."""
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
            performed = self._perform(value[begin + 2:end], place, nesting + 1)
            RECORDER.spend("characters of substitutions", len(performed))
            out += performed
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
                words = split_words(inner_text, place)
                first = words[0] if words and (quoted or " " in words[0]) else inner_text
                return run_command(split_words(first, place), place)
            return self._eval(inner_text[1:-1] if quoted else inner_text, place)
        words = split_words(inner_text, place)
        if name.replace("-", "_") not in _NAMES:
            raise LaunchError(f"'$({name} ...)' is not known", place)
        function = getattr(self, "_" + name.replace("-", "_"))
        if not _accepts(function, len(words)):
            raise LaunchError(f"'$({inner})' has the wrong number of arguments", place)
        return function(place, *words)

    def _var(self, place, name, default=None):
        values = self.context.launch_configurations
        # Those of namespaces and parameters in a scope are no texts, and not the file's.
        if isinstance(values.get(name), (str, bool, int, float)):
            return str(values[name])
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

    def _file_content(self, place, path):
        return file_text(path, place)

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
