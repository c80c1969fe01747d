"""Parameters that launch files give to nodes."""

__path__ = []  # modules below it are aliases

from launch.substitutions import Substitution
from launch.utilities import perform_substitutions, typed_value

from doppel_launch.record import RECORDER, LaunchError, describe_value, user_place


class ParameterValue:
    def __init__(self, value, *, value_type=None):
        self.value, self.value_type = value, value_type

    def evaluate(self, context):
        return evaluated(context, self.value, self.value_type)


class ParameterFile:
    def __init__(self, param_file, *, allow_substs=False):
        self.param_file, self.allow_substs, self.place = param_file, allow_substs, user_place()

    @property
    def path(self):
        return self.param_file

    def evaluate(self, context):
        from doppel_launch.frontends import substituted_file

        path = perform_substitutions(context, self.param_file)
        allowed = self.allow_substs
        if not isinstance(allowed, bool):
            allowed = perform_substitutions(context, allowed).lower() == "true"
        return substituted_file(path, context, self.place) if allowed else path


class Parameter:
    def __init__(self, name, value, *, value_type=None):
        self.name, self.value = name, ParameterValue(value, value_type=value_type)


ParameterDescription = Parameter


def _is_text(value):
    """Texts and substitutions, and lists of them with a substitution."""
    if isinstance(value, (str, Substitution)):
        return True
    return isinstance(value, (list, tuple)) and any(isinstance(one, Substitution) for one in value) and all(
        isinstance(one, (str, Substitution)) for one in value)


def evaluated(context, value, value_type=None):
    """A value as the node gets it: what a substitution gives is read as YAML, a plain text is not."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if isinstance(value, str):
        return value
    if hasattr(value, "perform") or _is_text(value):
        text = perform_substitutions(context, value)
        if value_type is str or text.lstrip().startswith("<"):
            return text
        return typed_value(text)
    if isinstance(value, (list, tuple)):
        return [evaluated(context, one) for one in value]
    return value


def evaluated_or_empty(context, name, value):
    """A file for planners that cannot be expanded does not stop the robot."""
    try:
        return evaluated(context, value)
    except LaunchError as error:
        if not name.endswith("_semantic"):
            raise
        RECORDER.warn("launch.parameter", error.place, f"the parameter '{name}' is empty: {error}", error.fix)
        return ""


def flattened(context, values, prefix=""):
    """Nested dictionaries as names with dots."""
    out = {}
    for key, value in values.items():
        name = prefix + perform_substitutions(context, key)
        if isinstance(value, dict):
            out.update(flattened(context, value, name + "."))
        else:
            out[name] = describe_value(evaluated_or_empty(context, name, value))
    return out


def parameter_records(context, parameters):
    """Files and values in order."""
    out = []
    for one in parameters or []:
        if isinstance(one, Parameter):
            out.append({"values": {perform_substitutions(context, one.name): describe_value(
                one.value.evaluate(context))}})
        elif isinstance(one, ParameterFile):
            out.append({"path": one.evaluate(context)})
        elif isinstance(one, dict):
            out.append({"values": flattened(context, one)})
        elif isinstance(one, (list, tuple)) and not _is_text(one):
            out.extend(parameter_records(context, one))
        elif one is not None:
            path = str(one) if hasattr(one, "__fspath__") else perform_substitutions(context, one)
            if path:
                out.append({"path": path})
    return out
