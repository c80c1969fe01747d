"""The names of the package `launch` of ROS 2, which record instead of starting."""

HAS_STAND_INS = True

from . import (  # noqa: F401
    actions, conditions, event_handlers, events, launch_description_sources, logging, substitutions, utilities)
from .action import Action, LaunchDescriptionEntity
from .conditions import Condition
from .event_handlers import EventHandler
from .events import Event
from .launch_context import LaunchContext
from .launch_description import LaunchDescription
from .launch_description_sources import LaunchDescriptionSource
from .some_substitutions_type import SomeSubstitutionsType
from .substitution import Substitution

from doppel_launch.unknown import unknown_attribute

__getattr__ = unknown_attribute(__name__)
