"""Names of nodes and their remappings in the scope of a visit."""

from launch.utilities import perform_substitutions, perform_text


def remap_records(context, remappings):
    return [[perform_substitutions(context, a), perform_substitutions(context, b)] for a, b in remappings or []]


def full_namespace(context, namespace):
    """The namespace of a node below those that were pushed."""
    pushed = context.launch_configurations.get("ros_namespace", "")
    own = perform_text(context, namespace) or ""
    if own.startswith("/") or not pushed:
        return own
    return (pushed.rstrip("/") + "/" + own).rstrip("/") if own else pushed


def push_namespace(context, namespace):
    name = full_namespace(context, namespace)
    context.launch_configurations["ros_namespace"] = name


def scoped_list(context, key):
    """A list of the scope; configurations are copied when a scope is pushed, lists in them are not changed.

    An argument of a launch file can have the same name, as in launch_ros: it is a text.
    """
    values = context.launch_configurations.get(key, ())
    return list(values) if isinstance(values, tuple) else []


def push_scoped(context, key, value):
    context.launch_configurations[key] = (*scoped_list(context, key), value)
