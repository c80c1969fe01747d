"""The actions of launch_ros. Each records what it would do."""

__path__ = []  # modules below it are aliases

from launch.action import Action
from launch.actions import ExecuteProcess, changed_environment
from launch.utilities import perform_substitutions, perform_text

from doppel_launch.record import RECORDER, describe_value, user_place
from doppel_launch.unknown import unknown_attribute

from .names import full_namespace, push_namespace, push_scoped, remap_records, scoped_list
from .parameter_descriptions import evaluated, parameter_records


class Node(ExecuteProcess):
    UNSPECIFIED_NODE_NAME = "<node_name_unspecified>"
    UNSPECIFIED_NODE_NAMESPACE = ""

    def __init__(self, *, executable=None, package=None, name=None, namespace=None, exec_name=None, parameters=None,
                 remappings=None, ros_arguments=None, arguments=None, **named):
        # Names of Dashing, which are still around.
        executable = executable if executable is not None else named.pop("node_executable", None)
        name = name if name is not None else named.pop("node_name", None)
        namespace = namespace if namespace is not None else named.pop("node_namespace", None)
        super().__init__(cmd=[], **named)
        self.package, self.executable, self.node_name, self.namespace = package, executable, name, namespace
        self.parameters, self.remappings = parameters, remappings
        self.ros_arguments, self.arguments = ros_arguments, arguments

    @property
    def node_package(self):
        return self.package

    @property
    def node_executable(self):
        return self.executable

    def subject(self, context):
        try:
            package = perform_text(context, self.package) or ""
            return f"{package} {perform_text(context, self.executable)}".strip()
        except Exception:  # a part may not exist where the condition is false
            return "a node"

    kind = "node"

    def execute(self, context):
        self.record = RECORDER.add(
            self.kind, self.place, package=perform_text(context, self.package),
            executable=perform_text(context, self.executable), name=perform_text(context, self.node_name),
            namespace=full_namespace(context, self.namespace),
            parameters=[*scoped_list(context, "ros_params"), *parameter_records(context, self.parameters)],
            remappings=[*scoped_list(context, "ros_remaps"), *remap_records(context, self.remappings)],
            words=[perform_substitutions(context, one) for one in self.arguments or []],
            ros_arguments=[perform_substitutions(context, one) for one in self.ros_arguments or []],
            cwd=perform_text(context, self.cwd),
            environment=changed_environment(context, self.env, self.additional_env))
        self.after_record(context)


class LifecycleNode(Node):
    def __init__(self, *, autostart=False, **named):
        super().__init__(**named)


class ComposableNodeContainer(Node):
    def __init__(self, *, composable_node_descriptions=None, **named):
        super().__init__(**named)
        self.nodes = composable_node_descriptions

    def execute(self, context):
        super().execute(context)
        components = [one.described(context) for one in self.nodes or [] if hasattr(one, "described")]
        self.record["components"] = [one for one in components if one is not None]


class LoadComposableNodes(Action):
    def __init__(self, *, composable_node_descriptions, target_container, **named):
        super().__init__(condition=named.get("condition"))
        self.nodes, self.target = composable_node_descriptions, target_container

    def execute(self, context):
        components = [one.described(context) for one in self.nodes or [] if hasattr(one, "described")]
        RECORDER.add("components", self.place, components=[one for one in components if one is not None])


class PushRosNamespace(Action):
    def __init__(self, namespace, **named):
        super().__init__(**named)
        self.namespace = namespace

    def execute(self, context):
        push_namespace(context, self.namespace)


PushROSNamespace = PushRosNamespace


class SetParameter(Action):
    def __init__(self, name, value, **named):
        super().__init__(**named)
        self.name, self.value = name, value

    def execute(self, context):
        value = evaluated(context, self.value)
        name = perform_substitutions(context, self.name)
        push_scoped(context, "global_params", (name, value))
        push_scoped(context, "ros_params", {"values": {name: describe_value(value)}})


class SetUseSimTime(SetParameter):
    def __init__(self, value, **named):
        super().__init__("use_sim_time", value, **named)


class SetParametersFromFile(Action):
    def __init__(self, filename, *, node_name=None, **named):
        super().__init__(condition=named.get("condition"))
        self.filename = filename

    def execute(self, context):
        push_scoped(context, "ros_params", {"path": perform_substitutions(context, self.filename)})


class SetRemap(Action):
    def __init__(self, src, dst, **named):
        super().__init__(**named)
        self.src, self.dst = src, dst

    def execute(self, context):
        push_scoped(context, "ros_remaps",
                    [perform_substitutions(context, self.src), perform_substitutions(context, self.dst)])


class SetROSLogDir(Action):
    def __init__(self, new_log_dir=None, **named):
        super().__init__(condition=named.get("condition"))


class RosTimer(Action):
    def __init__(self, *, period, actions, **named):
        super().__init__(condition=named.get("condition"))
        from launch.actions import TimerAction

        self.timer = TimerAction(period=period, actions=actions)
        self.timer.place = user_place()

    def execute(self, context):
        self.timer.visit(context)


ROSTimer = RosTimer


class LifecycleTransition(Action):
    def __init__(self, *, lifecycle_node_names, transition_ids=None, **named):
        super().__init__(condition=named.get("condition"))

    def execute(self, context):
        RECORDER.add("emit", self.place, name="a transition of a lifecycle node")




__getattr__ = unknown_attribute(__name__)
