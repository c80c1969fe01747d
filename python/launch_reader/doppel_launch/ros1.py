"""The elements of roslaunch. Parameters are those of one server: each is recorded with its full name."""

import os

from launch.substitutions import is_true, run_command
from launch.visit import each, nested, survey_skipped

from .host import absent_package
from .record import RECORDER, LaunchError, describe_value, errors_at
from .texts import split_words


class _Scope:
    """The namespace, remappings and environment of a place in the file."""

    def __init__(self, namespace="/", remappings=(), environment=None):
        self.namespace, self.remappings = namespace, list(remappings)
        self.environment = dict(environment or {})

    def inner(self, namespace):
        return _Scope(joined(self.namespace, namespace), self.remappings, self.environment)


def joined(namespace, name):
    """A name in a namespace, as ROS resolves it."""
    if not name:
        return namespace
    if name.startswith("/"):
        return name
    return namespace.rstrip("/") + "/" + name


def visit_ros1(root, context, texts, scope=None):
    """The children in order; arguments first are those that the file declares."""
    scope = scope or _Scope()
    with nested(context):
        each(root.children, lambda element: _visit_at(element, context, texts, scope))


def _visit_at(element, context, texts, scope):
    with errors_at(element.place):
        _visit(element, context, texts, scope)


def _is_there(element, texts):
    for name, meaning in (("if", True), ("unless", False)):
        if name in element.attributes:
            text = texts.text(element.get(name), element.place)
            if is_true(text or "false", element.place) != meaning:
                return False, f"{element.get(name)} is {text}"
    return True, ""


def _visit(element, context, texts, scope):
    there, why = _is_there(element, texts)
    if not there:
        if element.tag in ("node", "include", "group"):
            name = element.get("type", "file", "ns", default="")
            survey_skipped(f"<{element.tag}> {name}".strip(), why, element.place, context,
                           lambda: _HANDLERS[element.tag](element, context, texts, scope))
        return
    handler = _HANDLERS.get(element.tag)
    if handler is None:
        RECORDER.add("unknown", element.place, name=f"<{element.tag}>")
        return
    handler(element, context, texts, scope)


def _text(element, texts, *names, default=None):
    value = element.get(*names)
    return default if value is None else texts.text(value, element.place)


def _arg(element, context, texts, scope):
    name = element.need("name")
    values = context.launch_configurations
    if "value" in element.attributes:
        values[name] = _text(element, texts, "value")
        return
    given = name in values
    if not given:
        if "default" not in element.attributes and not RECORDER.survey:
            raise LaunchError(f"the argument '{name}' is required, and has no default", element.place,
                              f"append {name}:=VALUE")
        RECORDER.assumed = RECORDER.assumed or "default" not in element.attributes
        values[name] = _text(element, texts, "default", default="")
    if name not in RECORDER.arguments:
        RECORDER.arguments[name] = {
            "name": name, "file": element.place[0], "line": element.place[1], "value": values[name],
            "default": element.get("default", default=""), "description": element.get("doc", default=""),
            "choices": [], "given": given}


def _typed(text, kind):
    from launch.utilities import typed_value

    if kind in ("str", "string") or text.lstrip().startswith("<"):
        return text
    if kind == "yaml" or not kind:
        return typed_value(text)
    try:
        return {"int": int, "double": float, "bool": lambda t: t.lower() in ("true", "1")}[kind](text)
    except (KeyError, ValueError):
        return text


def _param_value(element, texts):
    if element.get("command") is not None:
        words = split_words(_text(element, texts, "command"), element.place)
        return run_command(words, element.place)
    if element.get("textfile") is not None:
        return run_command(["cat", _text(element, texts, "textfile")], element.place)
    return _typed(_text(element, texts, "value", default=""), element.get("type"))


def _param(element, context, texts, scope):
    name = joined(scope.namespace, texts.text(element.need("name"), element.place).lstrip("~"))
    try:
        value = _param_value(element, texts)
    except LaunchError as error:
        # A file for planners that cannot be expanded does not stop the robot.
        if not name.endswith("_semantic"):
            raise
        RECORDER.warn("launch.parameter", error.place, f"the parameter '{name}' is empty: {error}", error.fix)
        value = ""
    RECORDER.add("parameter", element.place, name=name, value=describe_value(value))


def _rosparam(element, context, texts, scope):
    if element.get("command", default="load") != "load":
        return
    namespace = joined(scope.namespace, _text(element, texts, "ns", default=""))
    namespace = joined(namespace, _text(element, texts, "param", default=""))
    file = _text(element, texts, "file")
    text = element.text
    if is_true(_text(element, texts, "subst_value", default="false"), element.place) and text.strip():
        text = texts.text(text, element.place)
    if file is not None:
        RECORDER.add("parameter", element.place, name=namespace, path=file, package=absent_package(file))
    elif text.strip():
        from launch.utilities import typed_value

        RECORDER.add("parameter", element.place, name=namespace, value=describe_value(typed_value(text)))


def _node(element, context, texts, scope):
    name = _text(element, texts, "name", default="")
    namespace = joined(scope.namespace, _text(element, texts, "ns", default=""))
    inner = _Scope(joined(namespace, name), scope.remappings, scope.environment)
    record = RECORDER.add(
        "node", element.place, package=texts.text(element.need("pkg"), element.place),
        executable=texts.text(element.need("type"), element.place), name=name,
        namespace="" if namespace == "/" else namespace, ros1=True,
        words=split_words(_text(element, texts, "args", default=""), element.place), cwd=_text(element, texts, "cwd"),
        required=is_true(_text(element, texts, "required", default="false"), element.place))
    with RECORDER.children(record):
        for child in element.children:
            _visit_at(child, context, texts, inner)
    RECORDER.extend(record, remappings=[list(one) for one in inner.remappings], environment=dict(inner.environment))
    if not record["children"]:
        del record["children"]


def _remap(element, context, texts, scope):
    scope.remappings.append(tuple(texts.text(element.need(name), element.place) for name in ("from", "to")))


def _env(element, context, texts, scope):
    scope.environment[element.need("name")] = _text(element, texts, "value", default="")


def _group(element, context, texts, scope):
    inner = scope.inner(_text(element, texts, "ns", default=""))
    visit_ros1(element, context, texts, inner)


def _include(element, context, texts, scope):
    from launch.launch_description_sources import visit_file

    from .frontends import _is_ros1, visit_markup
    from .markup import read_xml
    from .markup_substitutions import MarkupSubstitutions

    path = texts.text(element.need("file"), element.place)
    outer = context.launch_configurations
    # An included file sees only what it is given, or everything where pass_all_args says so.
    inner = dict(outer) if is_true(_text(element, texts, "pass_all_args", default="false"), element.place) else {}
    given = {}
    for child in element.children:
        there, _ = _is_there(child, texts)
        if there and child.tag == "arg":
            given[child.need("name")] = _text(child, texts, "value", "default", default="")
    inner.update(given)
    record = RECORDER.add("include", element.place, path=path, package=absent_package(path), arguments=given)
    if not os.path.exists(path):
        record["missing"] = True
        return
    if RECORDER.skipped_depth > 0 and os.path.abspath(path) in RECORDER.files:
        return
    namespace = _text(element, texts, "ns", default="")
    context.launch_configurations = inner
    try:
        with RECORDER.children(record):
            if path.endswith((".py", ".yaml", ".yml")):
                visit_file(path, context)
                return
            path = os.path.abspath(path)
            RECORDER.read_file(path)
            root = read_xml(path)
            if _is_ros1(root):
                visit_ros1(root, context, MarkupSubstitutions(context, path, True), scope.inner(namespace))
            else:
                visit_markup(path, context)
    finally:
        context.launch_configurations = outer


def _nothing(element, context, texts, scope):
    """Machines are those of a network of masters; tests are not part of a start."""


_HANDLERS = {"arg": _arg, "param": _param, "rosparam": _rosparam, "node": _node, "remap": _remap, "env": _env,
             "group": _group, "include": _include, "machine": _nothing, "test": _nothing}
