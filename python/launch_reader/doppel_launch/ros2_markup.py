"""The elements of launch_xml, launch_yaml and launch_ros as the actions of Python launch files."""

from launch import actions, conditions
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.utilities import typed_value
from launch.visit import each, survey_skipped, visit
from launch_ros import actions as ros_actions
from launch_ros import descriptions, parameter_descriptions

from .record import RECORDER, LaunchError, errors_at
from .texts import finite_number, split_words


def visit_ros2(root, context, texts):
    """The children in order."""
    each(root.children, lambda element: _visit_at(element, context, texts))


def _visit_at(element, context, texts):
    with errors_at(element.place):
        _visit_element(element, context, texts)


def _visit_element(element, context, texts):
    handler = _HANDLERS.get(element.tag.replace("-", "_"))
    condition = _condition(element, texts)
    if handler is None:
        if condition is None or condition.evaluate(context):
            RECORDER.add("unknown", element.place, name=f"<{element.tag}>")
        return
    if condition is not None and not condition.evaluate(context):
        survey_skipped(_subject(element), condition.text(context), element.place, context,
                       lambda: _visit_handled(element, handler, context, texts))
        return
    _visit_handled(element, handler, context, texts)


def _visit_handled(element, handler, context, texts):
    action = handler(element, texts, context)
    if action is None:
        return
    for one in action if isinstance(action, list) else [action]:
        one.place = element.place
        visit(one, context)


def _subject(element):
    words = [element.get(name) for name in ("pkg", "exec", "cmd", "file", "name")]
    return " ".join([f"<{element.tag}>", *[str(w) for w in words if w]])


def _condition(element, texts):
    for name, kind in (("if", conditions.IfCondition), ("unless", conditions.UnlessCondition)):
        value = element.get(name)
        if value is not None:
            return kind(texts.text(value, element.place))
    return None


class _Block(actions.Action):
    """The children of an element as one action."""

    def __init__(self, element, texts):
        super().__init__()
        self.element, self.texts = element, texts

    def execute(self, context):
        visit_ros2(self.element, context, self.texts)


def _value_of(element, texts, name, default=None):
    value = element.get(name)
    return default if value is None else texts.text(value, element.place)


def _pairs(element, texts, tag, left="name", right="value"):
    return [(texts.text(one.need(left), one.place), texts.text(one.need(right), one.place))
            for one in element.all(tag)]


def _arg(element, texts, context):
    if "value" in element.attributes and "default" not in element.attributes:
        return actions.SetLaunchConfiguration(element.need("name"), _value_of(element, texts, "value"))
    choices = [texts.text(one.need("value"), one.place) for one in element.all("choice")]
    return actions.DeclareLaunchArgument(
        element.need("name"), default_value=_value_of(element, texts, "default"),
        description=_value_of(element, texts, "description"), choices=choices or None)


def _let(element, texts, context):
    return actions.SetLaunchConfiguration(element.need("name"), texts.text(element.need("value"), element.place))


def _include(element, texts, context):
    source = AnyLaunchDescriptionSource(texts.text(element.need("file"), element.place))
    # Arguments are lists of mappings in YAML, too; `let` is what Jazzy and later call them.
    pairs = _pairs(element, texts, "arg") + _pairs(element, texts, "let")
    return actions.IncludeLaunchDescription(source, launch_arguments=pairs)


def _group(element, texts, context):
    scoped = str(_value_of(element, texts, "scoped", "true")).lower() not in ("false", "0")
    return actions.GroupAction([_Block(element, texts)], scoped=scoped)


def _parameters(element, texts):
    out = []
    for one in element.all("param"):
        if one.get("from") is not None:
            substitutes = str(one.get("allow_substs", default="false")).lower() == "true"
            file = parameter_descriptions.ParameterFile(
                texts.text(one.get("from"), one.place), allow_substs=substitutes)
            file.place = one.place
            out.append(file)
        else:
            out.append(_nested(one, texts))
    return out


def _nested(element, texts):
    name = element.need("name")
    listed = element.listed("value")
    if listed is not None:
        return {name: [_typed(texts.text(one, element.place), element) for one in listed]}
    if element.get("value") is None and element.all("param"):
        values = {}
        for one in element.all("param"):
            values.update(_nested(one, texts))
        return {name: values}
    value = element.need("value")
    separator = element.get("value-sep", "sep")
    text = texts.text(value, element.place)
    if separator:
        return {name: [_typed(one.strip(), element) for one in text.split(separator)]}
    return {name: _typed(text, element)}


def _typed(text, element):
    if element.get("type") == "str" or text.lstrip().startswith("<"):
        return text
    return typed_value(text)


def _node_arguments(element, texts):
    return {
        "name": _value_of(element, texts, "name"),
        "namespace": _value_of(element, texts, "namespace"),
        "parameters": _parameters(element, texts),
        "remappings": _pairs(element, texts, "remap", "from", "to"),
        "arguments": _words(element, texts, "args"), "ros_arguments": _words(element, texts, "ros_args"),
        "cwd": _value_of(element, texts, "cwd"),
        "additional_env": dict(_pairs(element, texts, "env")),
    }


def _words(element, texts, name):
    listed = element.listed(name)
    if listed is not None:
        return [texts.text(one, element.place) for one in listed]
    return split_words(_value_of(element, texts, name, ""), element.place)


def _delayed(element, texts, action):
    delay = _value_of(element, texts, "launch-delay") or _value_of(element, texts, "delay")
    return action if delay is None else actions.TimerAction(
        period=finite_number(delay, element.place), actions=[action])


def _node(element, texts, context):
    node = ros_actions.Node(package=texts.text(element.need("pkg"), element.place),
                            executable=texts.text(element.need("exec"), element.place),
                            **_node_arguments(element, texts))
    if str(element.get("on_exit", default="")) == "shutdown":
        node.on_exit = actions.Shutdown()
    node.place = element.place
    return _delayed(element, texts, node)


def _composable(element, texts):
    out = []
    for one in element.all("composable_node"):
        condition = _condition(one, texts)
        node = descriptions.ComposableNode(
            package=texts.text(one.need("pkg"), one.place), plugin=texts.text(one.need("plugin"), one.place),
            name=_value_of(one, texts, "name"), namespace=_value_of(one, texts, "namespace"),
            parameters=_parameters(one, texts), remappings=_pairs(one, texts, "remap", "from", "to"),
            condition=condition)
        node.place = one.place
        out.append(node)
    return out


def _node_container(element, texts, context):
    node = ros_actions.ComposableNodeContainer(
        package=_value_of(element, texts, "pkg", "rclcpp_components"),
        executable=_value_of(element, texts, "exec", "component_container"),
        composable_node_descriptions=_composable(element, texts), **_node_arguments(element, texts))
    return node


def _load_composable_node(element, texts, context):
    return ros_actions.LoadComposableNodes(composable_node_descriptions=_composable(element, texts),
                                           target_container=_value_of(element, texts, "target"))


def _executable(element, texts, context):
    if element.listed("cmd") is None:
        element.need("cmd")
    words = _words(element, texts, "cmd") + _words(element, texts, "args")
    shell = str(_value_of(element, texts, "shell", "false")).lower() == "true"
    return actions.ExecuteProcess(cmd=words, shell=shell, cwd=_value_of(element, texts, "cwd"),
                                  name=_value_of(element, texts, "name"),
                                  additional_env=dict(_pairs(element, texts, "env")))


def _timer(element, texts, context):
    period = finite_number(texts.text(element.need("period"), element.place), element.place)
    return actions.TimerAction(period=period, actions=[_Block(element, texts)])


def _set_env(element, texts, context):
    return actions.SetEnvironmentVariable(element.need("name"), _value_of(element, texts, "value", ""))


def _append_env(element, texts, context):
    return actions.AppendEnvironmentVariable(
        element.need("name"), _value_of(element, texts, "value", ""),
        prepend=str(element.get("prepend", default="false")).lower() == "true",
        separator=element.get("separator", default=":"))


def _gz_server(element, texts, context):
    import ros_gz_sim.actions as gazebo

    return _with_attributes(gazebo.GzServer(), element, texts)


def _gz_spawn_model(element, texts, context):
    import ros_gz_sim.actions as gazebo

    return _with_attributes(gazebo.GzSpawnModel(), element, texts)


def _with_attributes(action, element, texts):
    """All attributes are values of the action. (As arguments of a call some would have another meaning.)"""
    action.named = {name: texts.text(element.get(name), element.place) for name in element.attributes
                    if name not in ("if", "unless")}
    return action


def _ros_gz_bridge(element, texts, context):
    return ros_actions.Node(package="ros_gz_bridge", executable="bridge_node",
                            name=_value_of(element, texts, "bridge_name"),
                            parameters=[{"config_file": _value_of(element, texts, "config_file", "")}])


def _nothing(element, texts, context):
    return None


def _error(element, texts, context):
    raise LaunchError(f"<{element.tag}> may not be here", element.place)


_HANDLERS = {
    "arg": _arg, "declare_argument": _arg, "let": _let, "include": _include, "group": _group, "node": _node,
    "lifecycle_node": _node, "executable": _executable, "timer": _timer, "ros_timer": _timer,
    "node_container": _node_container, "load_composable_node": _load_composable_node,
    "composable_node": _error,
    "set_env": _set_env, "append_env": _append_env,
    "unset_env": lambda e, t, c: actions.UnsetEnvironmentVariable(e.need("name")),
    "set_parameter": lambda e, t, c: ros_actions.SetParameter(
        e.need("name"), typed_value(t.text(e.need("value"), e.place))),
    "set_use_sim_time": lambda e, t, c: ros_actions.SetUseSimTime(
        typed_value(t.text(e.need("value"), e.place))),
    "set_remap": lambda e, t, c: ros_actions.SetRemap(
        t.text(e.need("from"), e.place), t.text(e.need("to"), e.place)),
    "set_parameters_from_file": lambda e, t, c: ros_actions.SetParametersFromFile(
        t.text(e.need("filename"), e.place)),
    "push_ros_namespace": lambda e, t, c: ros_actions.PushRosNamespace(
        t.text(e.need("namespace"), e.place)),
    "log": lambda e, t, c: actions.LogInfo(msg=t.text(e.get("message", "value", default=""), e.place)),
    "log_info": lambda e, t, c: actions.LogInfo(msg=t.text(e.get("message", "value", default=""), e.place)),
    "shutdown": lambda e, t, c: actions.Shutdown(reason=_value_of(e, t, "reason", "")),
    "reset": lambda e, t, c: actions.ResetLaunchConfigurations(dict(_pairs(e, t, "keep"))),
    "gz_server": _gz_server, "gz_spawn_model": _gz_spawn_model, "ros_gz_bridge": _ros_gz_bridge,
    "keep_alive": _nothing, "set_ros_log_dir": _nothing, "push_launch_configurations": lambda e, t, c: (
        actions.PushLaunchConfigurations()),
    "pop_launch_configurations": lambda e, t, c: actions.PopLaunchConfigurations(),
}
