"""The names of ament_index_python."""

HAS_STAND_INS = True

from .packages import (  # noqa: F401
    PackageNotFoundError, get_package_prefix, get_package_share_directory, get_package_share_path,
    get_packages_with_prefixes, get_search_paths)
