"""The event handlers of launch: what follows what."""

__path__ = []  # modules below it are aliases

from doppel_launch.record import RECORDER, user_place
from doppel_launch.unknown import unknown_attribute

from .actions import Action


class BaseEventHandler:
    event_name = "event"

    def __init__(self, *, matcher=None, entities=None, handle_once=False, target_action=None, **_named):
        self.place = user_place()
        self.entities, self.target_action = entities, target_action

    def entities_of(self, context):
        """The entities; a function, which would see an event, is called where it takes the context only."""
        entities = self.entities
        if not callable(entities) or isinstance(entities, Action):
            return entities
        try:
            return entities(_Event(), context)
        except Exception:  # it reads the event
            RECORDER.add("unknown", self.place, name=f"the function of {type(self).__name__}")
            return None


class EventHandler(BaseEventHandler):
    pass


class _Event:
    """Of a process that has ended well."""

    returncode, action, text = 0, None, b""
    process_name = ""


class OnActionEventBase(BaseEventHandler):
    pass


class OnProcessExit(BaseEventHandler):
    event_name = "exit"

    def __init__(self, *, target_action=None, on_exit=None, **named):
        super().__init__(entities=on_exit, target_action=target_action, **named)


class OnProcessStart(BaseEventHandler):
    event_name = "start"

    def __init__(self, *, target_action=None, on_start=None, **named):
        super().__init__(entities=on_start, target_action=target_action, **named)


class OnExecutionComplete(BaseEventHandler):
    event_name = "completion"

    def __init__(self, *, target_action=None, on_completion=None, **named):
        super().__init__(entities=on_completion, target_action=target_action, **named)


class OnIncludeLaunchDescription(BaseEventHandler):
    event_name = "include"

    def __init__(self, **named):
        super().__init__(entities=None)


class OnProcessIO(BaseEventHandler):
    event_name = "output"

    def __init__(self, *, target_action=None, on_stdin=None, on_stdout=None, on_stderr=None, **named):
        # The functions wait for lines of output.
        super().__init__(entities=None, target_action=target_action)


class OnShutdown(BaseEventHandler):
    event_name = "shutdown"

    def __init__(self, *, on_shutdown=None, **named):
        # Nothing of doppel's own has to be cleaned up by it.
        super().__init__(entities=None)


__getattr__ = unknown_attribute(__name__)
