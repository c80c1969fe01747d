"""The base of actions."""

__path__ = []  # modules below it are aliases

from doppel_launch.record import RECORDER, user_place


class LaunchDescriptionEntity:
    """All that a launch description can contain."""

    place = ("", 0)


class Action(LaunchDescriptionEntity):
    """Something that happens if its condition is met."""

    def __new__(cls, *_arguments, **_named):
        self = super().__new__(cls)
        self.place = user_place()
        self.condition = None
        self.record = None
        return self

    def __init__(self, *, condition=None):
        self.condition = condition

    def visit(self, context, depth):
        if self.condition is not None and not self.condition.evaluate(context):
            self.record_skipped(context)
            return
        self.execute(context, depth)

    def record_skipped(self, context):
        subject = self.subject(context)
        if subject:
            RECORDER.add("skipped", self.place, name=subject, why=self.condition.text(context))

    def subject(self, context):
        """A name for what is skipped; empty: not worth a line."""
        return ""

    def execute(self, context, depth=0):
        """What happens. Classes of users override it with one argument, and may return entities."""

    def get_sub_entities(self):
        return []

    def describe(self):
        return type(self).__name__
