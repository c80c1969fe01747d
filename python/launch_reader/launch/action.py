"""The base of actions."""

__path__ = []  # modules below it are aliases

from doppel_launch.record import user_place


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

    def visit(self, context):
        if self.condition is not None and not self.condition.evaluate(context):
            self.record_skipped(context)
            return None
        return self.execute(context)

    def record_skipped(self, context):
        from .visit import survey_skipped, visit

        subject = self.subject(context)
        if subject:
            survey_skipped(subject, self.condition.text(context), self.place, context,
                           lambda: visit(self.execute(context), context))

    def subject(self, context):
        """A name for what is skipped; empty: not worth a line."""
        return ""

    def execute(self, context):
        """Records what happens; returns the entities that follow. Launch files have classes that override it."""

    def get_sub_entities(self):
        return []

    def describe(self):
        return type(self).__name__
