"""The logger of launch."""

import logging


def get_logger(name=None):
    return logging.getLogger(name or "launch")


class LaunchConfig:
    level = logging.INFO


launch_config = LaunchConfig()
