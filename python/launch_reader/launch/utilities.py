"""Substitutions in lists, as launch has them."""

__path__ = []  # modules below it are aliases

from .substitution import Substitution


def is_a(value, of_type):
    return isinstance(value, of_type)


def is_a_subclass(value, of_type):
    try:
        return issubclass(value, of_type)
    except TypeError:
        return False


def ensure_argument_type(*_arguments):
    """Types are checked where a value is used."""


def normalize_to_list_of_substitutions(subs):
    from .substitutions import TextSubstitution

    if subs is None:
        return []
    if isinstance(subs, Substitution):
        return [subs]
    if isinstance(subs, str):
        return [TextSubstitution(text=subs)]
    if isinstance(subs, (bool, int, float)) or hasattr(subs, "__fspath__"):
        return [TextSubstitution(text=str(subs))]
    out = []
    for one in subs:
        out.extend(normalize_to_list_of_substitutions(one))
    return out


def perform_substitutions(context, subs):
    """The text of a substitution, a text, or a list of both."""
    if isinstance(subs, str):
        return subs
    return "".join(one.perform(context) for one in normalize_to_list_of_substitutions(subs))


def perform_text(context, value):
    """None stays None."""
    return None if value is None else perform_substitutions(context, value)


def visit_all_entities_and_collect_futures(entity, context):
    from .visit import visit

    visit(entity, context)
    return []


def typed_value(text):
    """A text as YAML reads a scalar or a list of them."""
    import yaml

    from doppel_launch import bounded_yaml
    from doppel_launch.record import RECORDER

    RECORDER.spend("characters of YAML values", len(text))
    try:
        value = bounded_yaml.load(text)
    except yaml.YAMLError:
        return text
    return text if value is None and text.strip() not in ("null", "~") else value
