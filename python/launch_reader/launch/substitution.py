"""The base of substitutions."""

from doppel_launch.record import user_place


class Substitution:
    """A text that is known when the launch file runs."""

    def __new__(cls, *_arguments, **_named):
        self = super().__new__(cls)
        self.place = user_place()
        return self

    def perform(self, context):
        raise NotImplementedError

    def describe(self):
        return type(self).__name__ + "()"

    def __add__(self, other):
        return [self, other]
