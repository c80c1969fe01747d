"""Sources under the names of this package."""

from launch.launch_description_sources import XMLLaunchDescriptionSource, YAMLLaunchDescriptionSource  # noqa: F401
