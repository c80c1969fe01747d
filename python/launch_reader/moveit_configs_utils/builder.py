"""MoveItConfigsBuilder, for what doppel uses of it: the description, the SRDF, the controllers' files."""

import os
from pathlib import Path

from launch.utilities import perform_substitutions
from launch_param_builder import load_xacro, load_yaml
from launch_ros.parameter_descriptions import ParameterValue

from doppel_launch.host import share_folder


class _LaterXacro(ParameterValue):
    """An xacro file whose arguments are known when the launch file runs."""

    def __init__(self, path, mappings):
        super().__init__(None, value_type=str)
        self.path, self.mappings = path, mappings

    def evaluate(self, context):
        values = {perform_substitutions(context, k): perform_substitutions(context, v)
                  for k, v in self.mappings.items()}
        return load_xacro(self.path, values)


class MoveItConfigs:
    """The parts as dictionaries of parameters."""

    def __init__(self):
        self.package_path = None
        self.robot_description = {}
        self.robot_description_semantic = {}
        self.robot_description_kinematics = {}
        self.planning_pipelines = {}
        self.trajectory_execution = {}
        self.planning_scene_monitor = {}
        self.sensors_3d = {}
        self.move_group_capabilities = {"capabilities": "", "disable_capabilities": ""}
        self.joint_limits = {}
        self.moveit_cpp = {}
        self.pilz_cartesian_limits = {}

    def to_dict(self):
        out = {}
        for values in vars(self).values():
            if isinstance(values, dict):
                out.update(values)
        return out


class MoveItConfigsBuilder:
    def __init__(self, robot_name, robot_description="robot_description", package_name=None):
        self._robot_name = robot_name
        self._package_path = Path(share_folder(package_name or robot_name + "_moveit_config"))
        self._configs = MoveItConfigs()
        self._configs.package_path = self._package_path
        self._name = robot_description
        self._assistant = load_yaml(self._package_path / ".setup_assistant").get("moveit_setup_assistant_config", {})
        self._urdf_arguments = {}

    def _default_description(self):
        urdf = self._assistant.get("urdf") or self._assistant.get("URDF") or {}
        package, path = urdf.get("package"), urdf.get("relative_path")
        own = self._package_path / "config" / f"{self._robot_name}.urdf.xacro"
        if own.exists():
            return own
        if package and path:
            return Path(share_folder(package)) / path
        return own

    def robot_description(self, file_path=None, mappings=None):
        path = self._default_description() if file_path is None else self._package_path / file_path
        values = mappings or {}
        if all(isinstance(one, str) for one in values.values()):
            text = load_xacro(path, values) if os.path.exists(path) else ""
            self._configs.robot_description = {self._name: text}
        else:
            self._configs.robot_description = {self._name: _LaterXacro(path, values)}
        return self

    def robot_description_semantic(self, file_path=None, mappings=None):
        path = self._package_path / (file_path or f"config/{self._robot_name}.srdf")
        text = ""
        if os.path.exists(path):
            if str(path).endswith(".xacro") and not all(isinstance(v, str) for v in (mappings or {}).values()):
                text = ""
            else:
                text = load_xacro(path, mappings)
        self._configs.robot_description_semantic = {self._name + "_semantic": text}
        return self

    def _yaml(self, part, key, file_path, default):
        values = load_yaml(self._package_path / (file_path or default))
        setattr(self._configs, part, {key: values} if key else values)
        return self

    def robot_description_kinematics(self, file_path=None):
        return self._yaml("robot_description_kinematics", self._name + "_kinematics", file_path,
                          "config/kinematics.yaml")

    def joint_limits(self, file_path=None):
        return self._yaml("joint_limits", self._name + "_planning", file_path, "config/joint_limits.yaml")

    def moveit_cpp(self, file_path=None):
        return self._yaml("moveit_cpp", "", file_path, "config/moveit_cpp.yaml")

    def trajectory_execution(self, file_path=None, moveit_manage_controllers=True):
        self._yaml("trajectory_execution", "", file_path, "config/moveit_controllers.yaml")
        self._configs.trajectory_execution["moveit_manage_controllers"] = moveit_manage_controllers
        return self

    def pilz_cartesian_limits(self, file_path=None):
        return self._yaml("pilz_cartesian_limits", self._name + "_planning", file_path,
                          "config/pilz_cartesian_limits.yaml")

    def sensors_3d(self, file_path=None):
        return self._yaml("sensors_3d", "", file_path, "config/sensors_3d.yaml")

    def planning_scene_monitor(self, *_arguments, **values):
        self._configs.planning_scene_monitor = dict(values)
        return self

    def planning_pipelines(self, default_planning_pipeline=None, pipelines=None, load_all=True):
        names = list(pipelines or ["ompl"])
        self._configs.planning_pipelines = {"planning_pipelines": names}
        return self

    def to_moveit_configs(self):
        if not self._configs.robot_description:
            self.robot_description()
        if not self._configs.robot_description_semantic:
            self.robot_description_semantic()
        return self._configs

    def to_dict(self, include_moveit_configs=True):
        return self.to_moveit_configs().to_dict()

    def __getattr__(self, name):
        # Methods of other versions leave the description as it is.
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *_arguments, **_named: self
