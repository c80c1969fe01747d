"""Events are not there while a file is read; their names are."""

__path__ = []  # modules below it are aliases

from doppel_launch.unknown import unknown_attribute


class Event:
    """As in launch."""


class Shutdown(Event):
    def __init__(self, *, reason="", due_to_sigint=False):
        self.reason = reason


def matches_action(action):
    return lambda _event: True


__getattr__ = unknown_attribute(__name__)
HAS_STAND_INS = True
