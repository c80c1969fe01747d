"""A list of entities."""

from doppel_launch.record import user_place

from .action import LaunchDescriptionEntity
from .visit import visit


class LaunchDescription(LaunchDescriptionEntity):
    def __init__(self, initial_entities=None, *, deprecated_reason=None):
        self.place = user_place()
        self.entities = list(initial_entities or [])
        self.deprecated_reason = deprecated_reason

    def visit(self, context):
        visit(self.entities, context)

    def add_entity(self, entity):
        self.entities.append(entity)

    def add_action(self, action):
        self.entities.append(action)

    def get_launch_arguments(self, conditional_inclusion=False):
        from .actions import DeclareLaunchArgument

        return [one for one in self.entities if isinstance(one, DeclareLaunchArgument)]
