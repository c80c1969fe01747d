"""Spawners, as controller_manager makes them for launch files."""

from launch import LaunchDescription
from launch_ros.actions import Node

from doppel_launch.unknown import unknown_attribute


def generate_controllers_spawner_launch_description_from_dict(
        controller_info_dict, controller_manager_name="/controller_manager", extra_spawner_args=()):
    words = []
    for name, files in (controller_info_dict or {}).items():
        words.append(name)
        for file in files if isinstance(files, (list, tuple)) else [files]:
            if file:
                words += ["--param-file", file]
    words += ["--controller-manager", controller_manager_name, *extra_spawner_args]
    return LaunchDescription([Node(package="controller_manager", executable="spawner", arguments=words)])


def generate_controllers_spawner_launch_description(
        controller_names, controller_manager_name="/controller_manager", controller_params_files=None,
        extra_spawner_args=()):
    names = list(controller_names)
    return generate_controllers_spawner_launch_description_from_dict(
        dict.fromkeys(names, controller_params_files), controller_manager_name, extra_spawner_args)


def generate_load_controller_launch_description(controller_name, controller_params_file=None, extra_spawner_args=(),
                                                **_named):
    return generate_controllers_spawner_launch_description_from_dict(
        {controller_name: controller_params_file}, extra_spawner_args=extra_spawner_args)


__getattr__ = unknown_attribute(__name__)
