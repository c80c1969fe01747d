"""What a launch file describes: a tree of records, each with the file and line that made it."""

import contextlib
import math
import os
import re
import sys

_OWN_FOLDER = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


_python_files = 0  # that are being executed, one in another


@contextlib.contextmanager
def executed_python():
    """A `with` block in which a launch file in Python is executed, so that frames of its code exist."""
    global _python_files
    _python_files += 1
    try:
        yield
    finally:
        _python_files -= 1


def user_place():
    """File and line of the innermost frame outside of this program."""
    # Includes in XML and YAML have made hundreds of frames, and none of them is a user's.
    if not _python_files:
        return "", 0
    frame = sys._getframe(1)
    while frame is not None:
        file = frame.f_code.co_filename
        if not file.startswith(_OWN_FOLDER) and not file.startswith("<") and "/lib/python3" not in file:
            return os.path.abspath(file), frame.f_lineno
        frame = frame.f_back
    return "", 0


def place_of_error(error):
    """File and line of the user's code where an exception was thrown."""
    place = ("", 0)
    trace = error.__traceback__
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if not file.startswith(_OWN_FOLDER) and not file.startswith("<") and "/lib/python3" not in file:
            place = (os.path.abspath(file), trace.tb_lineno)
        trace = trace.tb_next
    if isinstance(error, SyntaxError) and error.filename:
        place = (os.path.abspath(error.filename), error.lineno or 0)
    return place


class LaunchError(Exception):
    """An error with a place and a fix."""

    def __init__(self, text, place=None, fix=""):
        super().__init__(text)
        self.place = place or user_place()
        self.fix = fix


class BoundError(LaunchError):
    """A launch file costs more than it may: nothing after it is read, also in a survey."""


@contextlib.contextmanager
def errors_at(place):
    """A `with` block whose errors have this place if they have none of their own."""
    try:
        yield
    except LaunchError as error:
        if not error.place[0]:
            error.place = place
        raise


def _kind(error):
    """The name of Python's own class that an exception belongs to."""
    cause = error.__cause__ or error
    return next(one.__name__ for one in type(cause).__mro__ if one.__module__ == "builtins" or one is LaunchError)


MAX_SHOWN = 2000  # characters of a message, which can have a value of any length
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def shown(text):
    """A text as a part of a message, which goes to a terminal."""
    text = text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN - 100]} ... {text[-90:]}"
    return _CONTROL.sub("?", text)


def error_record(error, path):
    """An exception as kind, text, place and fix; `path` is the file that was read."""
    if isinstance(error, LaunchError):
        text, place, fix = str(error), error.place if error.place[0] else (path, 1), error.fix
    elif isinstance(error, RecursionError):
        text, place, fix = "its includes are in a circle, or nested too deeply", (path, 1), ""
    else:
        place = place_of_error(error)
        text, place, fix = f"{type(error).__name__}: {error}", (place[0] or path, place[1] or 1), ""
    return {"kind": _kind(error), "text": shown(text), "file": place[0], "line": place[1], "fix": shown(fix)}


# What one launch file with all that it includes may have. The program reads a million parts of JSON (launch_json.cpp).
MAX_SPENT = {"bytes of launch files": 4 << 20, "included files": 1000, "characters of substitutions": 32 << 20,
             "characters of YAML values": 1 << 20, "parts of records": 900_000, "characters of records": 32 << 20}


PARTS_OF_TREE = 5  # the number of a record, and the list of its children


def _extent(value):
    """The parts of a value as the program's parser counts them, and its characters."""
    if isinstance(value, str):
        return 1, len(value)
    if not isinstance(value, (dict, list, tuple)):
        return 1, 0
    parts, characters = 2, 0
    for one in value if not isinstance(value, dict) else (*value.keys(), *value.values()):
        below = _extent(one)
        parts += below[0]
        characters += below[1]
    return parts, characters


class Recorder:
    """The records of one reading.

    In a survey all branches are recorded, those whose condition is not met as children of a skipped record, and the
    reading continues after an error.
    """

    survey = False

    def __init__(self):
        self.path = ""
        self.error = None  # the first one of a survey
        self.assumed = False  # an argument that is required has a value that nobody chose
        self.packages = []  # that are looked up, with their places
        self.expansions = []  # of xacro files
        self.skipped_depth = 0
        self.actions = []
        self.arguments = {}
        self.files = []
        self.warnings = []
        self.descriptions = {}  # text of a robot description -> where it comes from
        self._open = [self.actions]
        self._spent = dict.fromkeys(MAX_SPENT, 0)
        self._warned = set()

    def spend(self, what, count):
        """Counts what the reading costs. Raises BoundError beyond the bound."""
        self._spent[what] += count
        if self._spent[what] > MAX_SPENT[what]:
            raise BoundError(f"it has more than {MAX_SPENT[what]:,} {what}, with all that it includes and repeats", ("", 0))

    def _spend_record(self, record):
        parts, characters = _extent(record)
        self.spend("parts of records", parts)
        self.spend("characters of records", characters)

    def read_file(self, path):
        """Remembers that a launch file is read."""
        self.files.append(path)
        self.spend("included files", 1)

    def add(self, kind, place, **fields):
        """Adds a record to the one that is open."""
        record = {"kind": kind, "file": place[0], "line": place[1]}
        with errors_at(place):
            self.spend("parts of records", PARTS_OF_TREE)
            self._spend_record(record)
            self.extend(record, **fields)
        self._open[-1].append(record)
        return record

    def extend(self, record, **fields):
        """Adds fields that have a value to a record."""
        found = {k: v for k, v in fields.items() if v not in (None, "", [], {})}
        self._spend_record(found)
        record.update(found)

    def warn(self, rule, place, text, fix=""):
        """What is not known or not possible, and does not stop the reading."""
        found = {"rule": rule, "file": place[0], "line": place[1], "text": shown(text), "fix": shown(fix)}
        if tuple(found.values()) not in self._warned:
            self._warned.add(tuple(found.values()))
            self._spend_record(found)
            self.warnings.append(found)

    def failed(self, error):
        """Remembers the first error of a survey."""
        if self.error is None and not self.assumed:
            self.error = error_record(error, self.path)

    def look_up(self, package, place):
        """Remembers that a package is named."""
        if package:
            found = {"package": package, "file": place[0], "line": place[1]}
            self._spend_record(found)
            self.packages.append(found)

    def expand(self, file, arguments, place, call):
        """Remembers that a xacro file is expanded by a `call` at a place."""
        found = {"path": os.path.abspath(file), "file": place[0], "line": place[1], "call": call,
                 "arguments": [[str(k), str(v)] for k, v in arguments.items()]}
        self._spend_record(found)
        self.expansions.append(found)

    class _Children:
        def __init__(self, recorder, record):
            self._recorder = recorder
            record["children"] = []
            self._list = record["children"]

        def __enter__(self):
            self._recorder._open.append(self._list)

        def __exit__(self, *unused):
            self._recorder._open.pop()

    def children(self, record):
        """A `with` block whose records become children of `record`."""
        return Recorder._Children(self, record)

    def description(self, text, file, arguments):
        """Remembers that `text` is the expanded `file`; returns the text."""
        if text and file:
            self.descriptions[text.strip()] = {
                "source": os.path.abspath(file),
                "arguments": [[str(k), str(v)] for k, v in arguments.items()],
            }
        return text


RECORDER = Recorder()


def _number(value):
    """A number of 64 bits, or the text that YAML has for it: JSON has no others."""
    if isinstance(value, bool) or isinstance(value, int) and value.bit_length() < 64:
        return value
    try:
        value = float(value)
    except OverflowError:
        value = math.inf if value > 0 else -math.inf
    if math.isfinite(value):
        return value
    return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"


def describe_value(value):
    """A parameter's value as JSON; a robot's description with its source."""
    if isinstance(value, str):
        source = RECORDER.descriptions.get(value.strip())
        if source is not None:
            return dict(source, text=value)
        return value
    if isinstance(value, dict):
        # The program takes what has both of these keys for a description of the line above.
        if "text" in value and "source" in value:
            return str(value)
        return {str(k): describe_value(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [describe_value(v) for v in value]
    if isinstance(value, (int, float)):
        return _number(value)
    return None if value is None else str(value)
