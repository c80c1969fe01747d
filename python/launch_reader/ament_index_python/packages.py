"""Packages by name. One that is not on this machine has a folder that names it, and no files."""

__path__ = []  # modules below it are aliases

from doppel_launch.host import share_folder
from doppel_launch.record import user_place


class PackageNotFoundError(KeyError):
    """As in ament_index_python; never thrown here, see above."""


def get_package_share_directory(package_name, print_warning=True):
    return share_folder(package_name, user_place())


def get_package_share_path(package_name, print_warning=True):
    from pathlib import Path

    return Path(share_folder(package_name, user_place()))


get_package_prefix = get_package_share_directory


def get_packages_with_prefixes():
    return {}


def get_search_paths():
    return []
