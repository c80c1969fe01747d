"""The conditions of launch."""

__path__ = []  # modules below it are aliases

from doppel_launch.record import user_place
from doppel_launch.unknown import unknown_attribute

from .substitutions import is_true
from .utilities import perform_substitutions


class InvalidConditionExpressionError(Exception):
    """As in launch."""


class Condition:
    def __init__(self, *, predicate=None):
        self.place = user_place()
        self._predicate = predicate

    def evaluate(self, context):
        return self._predicate is None or bool(self._predicate(context))

    def text(self, context):
        """For a person who reads why an action is not there."""
        return type(self).__name__


def evaluate_condition_expression(context, expression):
    return is_true(perform_substitutions(context, expression), user_place())


class IfCondition(Condition):
    def __init__(self, predicate_expression):
        super().__init__()
        self.expression = predicate_expression

    def evaluate(self, context):
        return is_true(perform_substitutions(context, self.expression), self.place)

    def text(self, context):
        from .substitutions import LaunchConfiguration

        if isinstance(self.expression, LaunchConfiguration):
            name = perform_substitutions(context, self.expression.variable_name)
            return f"{name} is {perform_substitutions(context, self.expression)}"
        return "its condition is " + perform_substitutions(context, self.expression)


class UnlessCondition(IfCondition):
    def evaluate(self, context):
        return not super().evaluate(context)


class LaunchConfigurationEquals(Condition):
    def __init__(self, launch_configuration_name, expected_value):
        super().__init__()
        self.name, self.expected = launch_configuration_name, expected_value

    def evaluate(self, context):
        expected = None if self.expected is None else perform_substitutions(context, self.expected)
        return context.launch_configurations.get(self.name) == expected

    def text(self, context):
        return f"{self.name} is {context.launch_configurations.get(self.name)}"


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    def evaluate(self, context):
        return not super().evaluate(context)


__getattr__ = unknown_attribute(__name__)
