"""The launch descriptions that MoveIt generates for its packages."""

import os

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_param_builder import load_yaml
from launch_ros.actions import Node

from doppel_launch.unknown import unknown_attribute

from .launch_utils import DeclareBooleanLaunchArg


def _publisher(configs):
    return Node(package="robot_state_publisher", executable="robot_state_publisher", respawn=True, output="screen",
                parameters=[configs.robot_description])


def generate_rsp_launch(moveit_config):
    return LaunchDescription([_publisher(moveit_config)])


def generate_moveit_rviz_launch(moveit_config):
    return LaunchDescription([Node(package="rviz2", executable="rviz2")])


def generate_setup_assistant_launch(moveit_config):
    return LaunchDescription([Node(package="moveit_setup_assistant", executable="moveit_setup_assistant")])


def generate_static_virtual_joint_tfs_launch(moveit_config):
    import xml.etree.ElementTree as tree

    out = LaunchDescription()
    text = next(iter(moveit_config.robot_description_semantic.values()), "")
    if not text:
        return out
    for number, joint in enumerate(tree.fromstring(text).iter("virtual_joint")):
        if joint.get("type") == "fixed":
            out.add_action(Node(package="tf2_ros", executable="static_transform_publisher",
                                name=f"static_transform_publisher{number}",
                                arguments=["--frame-id", joint.get("parent_frame", ""), "--child-frame-id",
                                           joint.get("child_link", "")]))
    return out


def generate_spawn_controllers_launch(moveit_config):
    out = LaunchDescription()
    values = moveit_config.trajectory_execution
    if not values:
        values = load_yaml(moveit_config.package_path / "config/moveit_controllers.yaml")
    names = values.get("moveit_simple_controller_manager", {}).get("controller_names", [])
    for name in [*names, "joint_state_broadcaster"]:
        out.add_action(Node(package="controller_manager", executable="spawner", arguments=[name], output="screen"))
    return out


def generate_warehouse_db_launch(moveit_config):
    return LaunchDescription([Node(package="warehouse_ros_mongo", executable="mongo_wrapper_ros.py")])


def generate_move_group_launch(moveit_config):
    return LaunchDescription([Node(package="moveit_ros_move_group", executable="move_group")])


def generate_demo_launch(moveit_config, launch_package_path=None):
    folder = str(launch_package_path or moveit_config.package_path)
    out = LaunchDescription([DeclareBooleanLaunchArg("db"), DeclareBooleanLaunchArg("debug"),
                             DeclareBooleanLaunchArg("use_rviz", default_value=True)])
    joints = os.path.join(folder, "launch/static_virtual_joint_tfs.launch.py")
    if os.path.exists(joints):
        out.add_action(IncludeLaunchDescription(PythonLaunchDescriptionSource(joints)))
    out.add_action(_publisher(moveit_config))
    out.add_action(Node(package="moveit_ros_move_group", executable="move_group"))
    out.add_action(Node(package="rviz2", executable="rviz2", condition=IfCondition(LaunchConfiguration("use_rviz"))))
    out.add_action(Node(package="controller_manager", executable="ros2_control_node", parameters=[
        moveit_config.robot_description, os.path.join(folder, "config/ros2_controllers.yaml")]))
    for action in generate_spawn_controllers_launch(moveit_config).entities:
        out.add_action(action)
    return out


__all__ = ["DeclareLaunchArgument"]
__getattr__ = unknown_attribute(__name__)
