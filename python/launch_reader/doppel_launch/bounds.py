"""Bounds of what a launch file may cost: it may be that of somebody else, and its files may be pipes or without an end.

They are far above those of launch files that exist, and what exceeds one is refused at the place that exceeds it.
"""

import io
import os
import stat

from .host import absent_package
from .record import RECORDER, LaunchError

MAX_LAUNCH_FILE = 1 << 20  # bytes
MAX_OTHER_FILE = 64 << 20  # bytes of a description, as kMaxFileBytes of base/xml


def require_regular(path):
    """Refuses what is no file: a pipe waits without end, a device has no end, and some of them act when they are opened."""
    try:
        if stat.S_ISREG(os.stat(path).st_mode):
            return
    except OSError as error:
        raise LaunchError(f"'{path}' cannot be read: {error.strerror}", ("", 0)) from error
    except ValueError as error:  # a zero byte
        raise LaunchError(f"{path!r} is no path", ("", 0)) from error
    raise LaunchError(f"'{path}' is not a regular file", ("", 0))


def file_bytes(path, most):
    """The content of a file. The error has the place of the element that is read."""
    try:
        require_regular(path)
        with open(path, "rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise LaunchError(f"'{path}' cannot be read: {error.strerror}", ("", 0)) from error
    if len(data) > most:
        raise LaunchError(f"'{path}' is larger than {most >> 20} MB", ("", 0))
    return data


def launch_file_bytes(path):
    """The content of a launch file."""
    data = file_bytes(path, MAX_LAUNCH_FILE)
    RECORDER.spend("bytes of launch files", len(data))
    return data


def file_text(path, place):
    """The content of a file that a launch file names, which may be a robot's description.

    In a survey the reading goes on with an empty text where the file does not exist.
    """
    try:
        data = file_bytes(path, MAX_OTHER_FILE)
    except LaunchError as error:
        error.place = place
        if not RECORDER.survey or not isinstance(error.__cause__, FileNotFoundError):
            raise
        if not absent_package(path):
            RECORDER.failed(error)
        return ""
    text = io.TextIOWrapper(io.BytesIO(data), encoding="utf-8", errors="replace").read()
    return RECORDER.description(text, path, {})
