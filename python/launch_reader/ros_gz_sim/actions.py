"""Actions of ros_gz_sim: a server, and a model that is created in it."""

from launch.action import Action
from launch.utilities import perform_text

from doppel_launch.record import RECORDER
from doppel_launch.unknown import unknown_attribute


class _Performed(Action):
    kind = ""

    def __init__(self, *, condition=None, **named):
        super().__init__(condition=condition)
        self.named = named

    def subject(self, context):
        return self.kind

    def execute(self, context):
        values = {}
        for name, value in self.named.items():
            if isinstance(value, (list, tuple)) and not value:
                continue
            values[name] = str(value) if isinstance(value, (bool, int, float)) else perform_text(context, value)
        RECORDER.add(self.kind, self.place, values={k: v for k, v in values.items() if v})


class GzServer(_Performed):
    kind = "gz_server"


class GzSpawnModel(_Performed):
    kind = "gz_spawn_model"


__getattr__ = unknown_attribute(__name__)
