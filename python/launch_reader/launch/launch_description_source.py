"""The base of sources under the name of its module."""

from .launch_description_sources import LaunchDescriptionSource  # noqa: F401
