"""Launch files that are not Python."""

import os

from .bounds import MAX_OTHER_FILE, file_bytes
from .markup import read_xml, read_yaml
from .markup_substitutions import MarkupSubstitutions
from .record import RECORDER, LaunchError, errors_at


def _is_ros1(root):
    """roslaunch and launch_xml have the same root: nodes of one have a type, those of the other an exec."""
    todo = list(root.children)
    while todo:
        element = todo.pop()
        if element.tag == "node":
            return "type" in element.attributes and "exec" not in element.attributes
        if element.tag in ("rosparam", "machine", "test"):
            return True
        if element.tag == "param" and ("command" in element.attributes or "textfile" in element.attributes):
            return True
        for value in element.attributes.values():
            if isinstance(value, str) and ("$(var " in value or "$(find-pkg-share " in value):
                return False
            if isinstance(value, str) and ("$(find " in value or "$(arg " in value):
                return True
        todo.extend(element.children)
    return root.place[0].endswith(".launch")


def visit_markup(path, context):
    """A launch file in XML or YAML, of ROS 2 or ROS 1."""
    from .ros1 import visit_ros1
    from .ros2_markup import visit_ros2

    yaml_file = path.endswith((".yaml", ".yml"))
    root = read_yaml(path) if yaml_file else read_xml(path)
    ros1 = not yaml_file and _is_ros1(root)
    texts = MarkupSubstitutions(context, path, ros1)
    (visit_ros1 if ros1 else visit_ros2)(root, context, texts)


def substituted_file(path, context, place):
    """A parameter file whose substitutions are performed: the file itself where it has none."""
    from .host import HOST

    if not os.path.exists(path):
        return path
    with errors_at(place):
        data = file_bytes(path, MAX_OTHER_FILE)
    if b"$(" not in data:
        return path
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise LaunchError(f"'{path}' is not UTF-8", place) from None
    made = HOST.write_file(os.path.basename(path), MarkupSubstitutions(context, path, False).text(text, place))
    RECORDER.descriptions.setdefault("made:" + made, {"source": path, "arguments": []})
    return made
