"""YAML whose aliases may not multiply what they stand for, and whose levels are bounded."""

import yaml

MAX_NODES = 20_000  # with those that aliases repeat
MAX_LEVELS = 100    # consumers of the tree recurse


class BoundedYamlError(yaml.MarkedYAMLError):
    """It is YAML, and too much of it."""


class _Loader(yaml.SafeLoader):
    def __init__(self, text):
        super().__init__(text)
        self._levels = self._nodes = 0
        self._sizes = {}  # of the nodes that are complete, with all below them

    def compose_node(self, parent, index):
        event = self.peek_event()
        before = self._nodes
        self._levels += 1
        if self._levels > MAX_LEVELS:
            raise BoundedYamlError(None, None, f"it is nested more than {MAX_LEVELS} deep", event.start_mark)
        node = super().compose_node(parent, index)
        self._levels -= 1
        if not isinstance(event, yaml.AliasEvent):
            self._add(1, event)
            self._sizes[id(node)] = self._nodes - before
        elif id(node) in self._sizes:
            self._add(self._sizes[id(node)], event)
        else:
            raise BoundedYamlError(None, None, f"the alias '{event.anchor}' is inside of what it stands for", event.start_mark)
        return node

    def _add(self, count, event):
        self._nodes += count
        if self._nodes > MAX_NODES:
            raise BoundedYamlError(None, None, f"it has more than {MAX_NODES:,} values", event.start_mark)


def compose(text):
    """The root node. Raises yaml.YAMLError."""
    loader = _Loader(text)
    try:
        return loader.get_single_node()
    except ValueError as error:
        raise yaml.MarkedYAMLError(None, None, "an escape stands for no character", loader.get_mark()) from error
    finally:
        loader.dispose()


def _plain(value):
    """Dates, sets and bytes as texts and lists, which JSON has; keys as texts."""
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple, set)):
        return [_plain(one) for one in value]
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def load(text):
    """The value of a text. Raises yaml.YAMLError."""
    try:
        return _plain(yaml.load(text, Loader=_Loader))
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # PyYAML throws these where a tag or a form promises a number, a date or a truth value that the text is not.
        raise yaml.YAMLError(f"a value is not what its form promises: {error}") from error
