"""The names of xacro; doppel expands."""

from doppel_launch.host import HOST
from doppel_launch.record import RECORDER, user_place


class XacroException(Exception):
    """As in xacro."""


def _expanded(file, mappings):
    arguments = dict(mappings or {})
    RECORDER.expand(str(file), arguments, user_place(), "process_file")
    text, source = HOST.expand(str(file), arguments)
    return RECORDER.description(text, source, arguments)


class _Document:
    """A parsed file; `process_doc` expands it."""

    def __init__(self, file, mappings=None, expanded=False):
        self.file, self.mappings = str(file), mappings
        self._text = _expanded(file, mappings) if expanded else None

    def toxml(self, *_arguments, **_named):
        if self._text is None:
            with open(self.file, encoding="utf-8") as file:
                return RECORDER.description(file.read(), self.file, {})
        return self._text

    toprettyxml = toxml

    def expand(self, mappings):
        self._text = _expanded(self.file, mappings)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        from xml.dom import minidom

        return getattr(minidom.parseString(self.toxml()), name)


def parse(inp, filename=None):
    return _Document(getattr(inp, "name", None) or filename or inp)


def process_doc(doc, *, mappings=None, **_named):
    doc.expand(mappings)


def process_file(input_file_name, **named):
    return _Document(input_file_name, named.get("mappings"), expanded=True)


def process(input_file_name, just_deps=False, xacro_ns=True, verbosity=1, mappings=None):
    return _expanded(input_file_name, mappings)


def open_output(output_filename):
    return open(output_filename, "w", encoding="utf-8")


def load_yaml(filename):
    import yaml

    with open(filename, encoding="utf-8") as file:
        return yaml.safe_load(file)
