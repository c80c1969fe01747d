"""A reader that may only read: what a launch file tries beside it is recorded, and goes nowhere.

The kernel refuses it anyway (doppel's ChildStart::confined); with these stand-ins the reading continues after it.
"""

import builtins
import io
import os
import subprocess
import sys
import tempfile

from .host import absent_package
from .record import RECORDER, LaunchError, user_place


def _called_by_user():
    """False for the caller of a stand-in that is Python's own library."""
    file = sys._getframe(2).f_code.co_filename
    return not file.startswith("<") and "/lib/python3" not in file


def _refused(effect):
    """Only a word and a place are reported: names could have what the file has read."""
    RECORDER.warn(f"launch.confined.{effect}", user_place(), "")


class _TextFile(io.StringIO):
    """A file that is not written."""

    def __init__(self, name):
        super().__init__()
        self.name = name


class _BinaryFile(io.BytesIO):
    """A file that is not written."""

    def __init__(self, name):
        super().__init__()
        self.name = name


def _unwritten(name, mode):
    _refused("file")
    return _BinaryFile(name) if "b" in mode else _TextFile(name)


_open = io.open


def _open_to_read(file, mode="r", *arguments, **named):
    if isinstance(mode, str) and isinstance(file, (str, bytes, os.PathLike)) and set(mode) & set("wax+"):
        return _unwritten(os.fsdecode(file), mode)
    try:
        return _open(file, mode, *arguments, **named)
    except FileNotFoundError as error:
        if not _called_by_user():
            raise
        if not absent_package(file):
            RECORDER.failed(LaunchError(str(error)))
        return (_BinaryFile if "b" in mode else _TextFile)(os.fsdecode(file))


def _temporary_file(mode="w+b", *_arguments, suffix="", prefix="tmp", dir=None, **_named):
    return _unwritten(f"{dir or '/tmp'}/{prefix or ''}unwritten{suffix or ''}", mode)


def _temporary_folder(suffix="", prefix="tmp", dir=None):
    name = f"{dir or '/tmp'}/{prefix or ''}unwritten{suffix or ''}"
    _refused("folder")
    return name


def _folder(name, *_arguments, **_named):
    if not os.path.isdir(name):
        _refused("folder")


class _EndedProcess:
    """A program that was not started, as one that has ended well without output."""

    returncode, pid, stdin = 0, 0, None

    def __init__(self, args, *_arguments, **named):
        self.args = args
        _refused("command")
        texts = ("text", "universal_newlines", "encoding", "errors")
        self._empty = "" if any(named.get(one) for one in texts) else b""
        piped = named.get("stdout") == subprocess.PIPE
        self.stdout = (io.StringIO() if self._empty == "" else io.BytesIO()) if piped else None
        self.stderr = None

    def __enter__(self):
        return self

    def __exit__(self, *_unused):
        return False

    def communicate(self, *_arguments, **_named):
        return self._empty, self._empty

    def wait(self, *_arguments, **_named):
        return 0

    poll = wait

    def send_signal(self, *_arguments):
        """It has ended."""

    terminate = kill = send_signal


class _Variables(type(os.environ)):
    """A variable that a launch file needs and that is not set is empty."""

    def __getitem__(self, name):
        try:
            return super().__getitem__(name)
        except KeyError:
            if not _called_by_user():
                raise
            RECORDER.assumed = True
            return ""


def _no_command(_command):
    _refused("command")
    return 0


def install():
    """Replaces the functions with effects that launch files use."""
    builtins.open = io.open = _open_to_read
    tempfile.NamedTemporaryFile = tempfile.TemporaryFile = _temporary_file
    tempfile.mkdtemp = _temporary_folder
    tempfile.gettempdir = lambda: "/tmp"
    os.makedirs = os.mkdir = _folder
    os.system = _no_command
    os.environ.__class__ = _Variables
    os.popen = lambda command, *_arguments: _TextFile(str(_no_command(command)))
    subprocess.Popen = _EndedProcess
