"""What a launch file describes: a tree of records, each with the file and line that made it."""

import os
import sys

_OWN_FOLDER = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def user_place():
    """File and line of the innermost frame outside of this program."""
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


def _kind(error):
    """The name of Python's own class that an exception belongs to."""
    cause = error.__cause__ or error
    return next(one.__name__ for one in type(cause).__mro__ if one.__module__ == "builtins" or one is LaunchError)


def error_record(error, path):
    """An exception as kind, text, place and fix; `path` is the file that was read."""
    if isinstance(error, LaunchError):
        text, place, fix = str(error), error.place, error.fix
    elif isinstance(error, RecursionError):
        text, place, fix = "its includes are in a circle, or nested too deeply", (path, 1), ""
    else:
        place = place_of_error(error)
        text, place, fix = f"{type(error).__name__}: {error}", (place[0] or path, place[1] or 1), ""
    return {"kind": _kind(error), "text": text, "file": place[0], "line": place[1], "fix": fix}


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

    def add(self, kind, place, **fields):
        """Adds a record to the one that is open."""
        record = {"kind": kind, "file": place[0], "line": place[1]}
        record.update({k: v for k, v in fields.items() if v not in (None, "", [], {})})
        self._open[-1].append(record)
        return record

    def warn(self, rule, place, text, fix=""):
        """What is not known or not possible, and does not stop the reading."""
        found = {"rule": rule, "file": place[0], "line": place[1], "text": text, "fix": fix}
        if found not in self.warnings:
            self.warnings.append(found)

    def failed(self, error):
        """Remembers the first error of a survey."""
        if self.error is None and not self.assumed:
            self.error = error_record(error, self.path)

    def look_up(self, package, place):
        """Remembers that a package is named."""
        if package:
            self.packages.append({"package": package, "file": place[0], "line": place[1]})

    def expand(self, file, arguments, place, call):
        """Remembers that a xacro file is expanded by a `call` at a place."""
        self.expansions.append({"path": os.path.abspath(file), "file": place[0], "line": place[1], "call": call,
                                "arguments": [[str(k), str(v)] for k, v in arguments.items()]})

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


def describe_value(value):
    """A parameter's value as JSON; a robot's description with its source."""
    if isinstance(value, str):
        source = RECORDER.descriptions.get(value.strip())
        if source is not None:
            return dict(source, text=value)
        return value
    if isinstance(value, dict):
        return {str(k): describe_value(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [describe_value(v) for v in value]
    if isinstance(value, (bool, int, float)) or value is None:
        return value
    return str(value)
