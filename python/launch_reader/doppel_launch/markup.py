"""Launch files in XML and YAML as one tree of elements, with lines."""

import re
import xml.parsers.expat

from .bounds import launch_file_bytes
from .record import RECORDER, LaunchError

MAX_ELEMENTS = 100_000  # of a file, with those that entities repeat
MAX_DEPTH = 400         # consumers of the tree recurse
MAX_TEXT = 8 << 20      # characters of texts and values of a file, with those that entities repeat


class Element:
    """A tag with attributes and children. A text is that of XML, a value that of YAML."""

    def __init__(self, tag, file, line):
        self.tag, self.place = tag, (file, line)
        self.attributes, self.children, self.text = {}, [], ""

    def get(self, *names, default=None):
        """The first attribute of these names, a text."""
        for name in names:
            if name in self.attributes:
                value = self.attributes[name]
                if isinstance(value, list):
                    raise LaunchError(f"'{name}' of <{self.tag}> is a list, and must be a text", self.place)
                return value
        return default

    def listed(self, name):
        """The texts of an attribute that is a list in YAML; None: it is not there, or a text."""
        value = self.attributes.get(name)
        return value if isinstance(value, list) else None

    def need(self, *names):
        value = self.get(*names)
        if value is None:
            raise LaunchError(f"<{self.tag}> without '{names[0]}'", self.place)
        return value

    def all(self, *tags):
        return [one for one in self.children if one.tag in tags]


class _XmlTree:
    """Builds the tree of a file. Entities of other files are not read: expat has no handler for them here."""

    def __init__(self, path):
        self.path = path
        self.root, self._stack, self._texts = None, [], []
        self._elements = self._characters = 0
        self.parser = xml.parsers.expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text

    def _place(self):
        return self.path, self.parser.CurrentLineNumber

    def _start(self, tag, attributes):
        element = Element(tag, *self._place())
        element.attributes = attributes
        self._elements += 1
        if self._elements > MAX_ELEMENTS:
            raise LaunchError(f"the file has more than {MAX_ELEMENTS:,} elements", self._place())
        if len(self._stack) >= MAX_DEPTH:
            raise LaunchError(f"elements are nested more than {MAX_DEPTH} deep", self._place())
        self._count(sum(map(len, attributes.values())))
        if self._stack:
            self._stack[-1].children.append(element)
        else:
            self.root = element
        self._stack.append(element)
        self._texts.append([])

    def _end(self, _tag):
        self._stack.pop().text = "".join(self._texts.pop())

    def _text(self, data):
        self._count(len(data))
        self._texts[-1].append(data)

    def _count(self, characters):
        self._characters += characters
        if self._characters > MAX_TEXT:
            raise LaunchError(f"its texts are larger than {MAX_TEXT >> 20} MB", self._place())


def read_xml(path):
    """The root element. Raises LaunchError with the place of an error."""
    data = launch_file_bytes(path)
    tree = _XmlTree(path)
    try:
        tree.parser.Parse(data, True)
    except xml.parsers.expat.ExpatError as error:
        text = xml.parsers.expat.ErrorString(error.code) or f"error {error.code}"
        raise LaunchError(f"this is not XML: {text}", (path, error.lineno)) from None
    except (LookupError, ValueError) as error:  # of the encoding that the file names
        raise LaunchError(f"this is not XML: {error}", (path, 1)) from None
    if tree.root.tag != "launch":
        raise LaunchError(f"the root is <{tree.root.tag}>, not <launch>", tree.root.place)
    return tree.root


def _yaml_text(path):
    data = launch_file_bytes(path)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise LaunchError(f"this is not YAML: the byte 0x{data[error.start]:02x} is not UTF-8", (path, line)) from None
    RECORDER.spend("characters of YAML values", len(text))
    return text.removeprefix("\ufeff")


def read_yaml(path):
    """The same tree of a YAML file: a mapping's scalars are attributes, its lists are children."""
    import yaml

    from . import bounded_yaml

    text = _yaml_text(path)
    try:
        node = bounded_yaml.compose(text)
    except bounded_yaml.BoundedYamlError as error:
        raise LaunchError(error.problem, (path, error.problem_mark.line + 1)) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise LaunchError(f"this is not YAML: the character #x{error.character:04x} is not permitted", (path, line)) from None
    except yaml.YAMLError as error:
        # Names of the file are left out: an include can name any file.
        problem = re.sub(r" '(?!<)[^']{2,}'", "", getattr(error, "problem", None) or "it is malformed")
        mark = getattr(error, "problem_mark", None)
        raise LaunchError(f"this is not YAML: {problem}", (path, mark.line + 1 if mark else 1)) from None
    root = Element("launch", path, 1)
    if node is None:
        return root
    if not isinstance(node, yaml.MappingNode) or [k.value for k, _ in node.value] != ["launch"]:
        raise LaunchError("a launch file in YAML has the one key 'launch'", (path, node.start_mark.line + 1))
    _add_children(root, node.value[0][1], path)
    return root


def _key(node, path):
    import yaml

    if not isinstance(node, yaml.ScalarNode):
        raise LaunchError("the key of a mapping is not a text", (path, node.start_mark.line + 1))
    return node.value


def _add_children(parent, node, path):
    import yaml

    items = node.value if isinstance(node, yaml.SequenceNode) else [node]
    for item in items:
        if not isinstance(item, yaml.MappingNode):
            continue
        for key, value in item.value:
            _add_element(parent, key, value, path)


# Lists of mappings that stand for several elements of one name.
_LISTS = {"param", "remap", "env", "arg", "let", "composable_node", "extra_arg", "rosparam", "choice", "keep"}


def _add_element(parent, key, value, path):
    import yaml

    tag = _key(key, path)
    if isinstance(value, yaml.SequenceNode) and tag in _LISTS:
        for one in value.value:
            _add_element(parent, key, one, path)
        return
    element = Element(tag, path, key.start_mark.line + 1)
    parent.children.append(element)
    if isinstance(value, yaml.MappingNode):
        for name_node, content in value.value:
            name = _key(name_node, path)
            if isinstance(content, yaml.ScalarNode):
                element.attributes[name] = content.value
            elif name in ("children", "launch"):
                _add_children(element, content, path)
            elif isinstance(content, yaml.SequenceNode) and all(
                    isinstance(one, yaml.ScalarNode) for one in content.value):
                element.attributes[name] = [one.value for one in content.value]
            else:
                _add_element(element, name_node, content, path)
    elif isinstance(value, yaml.ScalarNode):
        # `- push_ros_namespace: left`
        element.attributes["value"] = element.attributes["namespace"] = element.attributes["name"] = value.value
    else:
        _add_children(element, value, path)
