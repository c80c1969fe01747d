"""Launch files in XML and YAML as one tree of elements, with lines."""

import xml.parsers.expat

from .record import LaunchError


class Element:
    """A tag with attributes and children. A text is that of XML, a value that of YAML."""

    def __init__(self, tag, file, line):
        self.tag, self.place = tag, (file, line)
        self.attributes, self.children, self.text = {}, [], ""

    def get(self, *names, default=None):
        """The first attribute of these names."""
        for name in names:
            if name in self.attributes:
                return self.attributes[name]
        return default

    def need(self, *names):
        value = self.get(*names)
        if value is None:
            raise LaunchError(f"<{self.tag}> without '{names[0]}'", self.place)
        return value

    def all(self, *tags):
        return [one for one in self.children if one.tag in tags]


def read_xml(path):
    """The root element. Raises LaunchError with the place of an error."""
    parser = xml.parsers.expat.ParserCreate()
    root, stack = [], []

    def start(tag, attributes):
        element = Element(tag, path, parser.CurrentLineNumber)
        element.attributes = attributes
        (stack[-1].children if stack else root).append(element)
        stack.append(element)

    def text(data):
        if stack:
            stack[-1].text += data

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _tag: stack.pop()
    parser.CharacterDataHandler = text
    try:
        with open(path, "rb") as file:
            parser.ParseFile(file)
    except xml.parsers.expat.ExpatError as error:
        text = xml.parsers.expat.errors.messages[error.code]
        raise LaunchError(f"this is not XML: {text}", (path, error.lineno)) from error
    if root[0].tag != "launch":
        raise LaunchError(f"the root is <{root[0].tag}>, not <launch>", root[0].place)
    return root[0]


def read_yaml(path):
    """The same tree of a YAML file: a mapping's scalars are attributes, its lists are children."""
    import yaml

    with open(path, encoding="utf-8") as file:
        text = file.read()
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        raise LaunchError(f"this is not YAML: {getattr(error, 'problem', error)}",
                          (path, mark.line + 1 if mark else 1)) from error
    root = Element("launch", path, 1)
    if node is None:
        return root
    if not isinstance(node, yaml.MappingNode) or [k.value for k, _ in node.value] != ["launch"]:
        raise LaunchError("a launch file in YAML has the one key 'launch'", (path, node.start_mark.line + 1))
    _add_children(root, node.value[0][1], path)
    return root


def _scalar(node):
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
_LISTS = {"param", "remap", "env", "arg", "let", "composable_node", "extra_arg", "rosparam"}


def _add_element(parent, key, value, path):
    import yaml

    if isinstance(value, yaml.SequenceNode) and key.value in _LISTS:
        for one in value.value:
            _add_element(parent, key, one, path)
        return
    element = Element(key.value, path, key.start_mark.line + 1)
    parent.children.append(element)
    if isinstance(value, yaml.MappingNode):
        for name, content in value.value:
            if isinstance(content, yaml.ScalarNode):
                element.attributes[name.value] = _scalar(content)
            elif name.value in ("children", "launch"):
                _add_children(element, content, path)
            elif isinstance(content, yaml.SequenceNode) and all(
                    isinstance(one, yaml.ScalarNode) for one in content.value):
                element.attributes[name.value] = [one.value for one in content.value]
            else:
                _add_element(element, name, content, path)
    elif isinstance(value, yaml.ScalarNode):
        # `- push_ros_namespace: left`
        element.attributes["value"] = element.attributes["namespace"] = element.attributes["name"] = value.value
    else:
        _add_children(element, value, path)
