"""Event handlers of lifecycle nodes."""

__path__ = []  # modules below it are aliases

from launch.event_handlers import BaseEventHandler

from doppel_launch.unknown import unknown_attribute


class OnStateTransition(BaseEventHandler):
    event_name = "transition"

    def __init__(self, *, entities=None, target_lifecycle_node=None, goal_state=None, **named):
        super().__init__(entities=entities, target_action=target_lifecycle_node)


__getattr__ = unknown_attribute(__name__)
