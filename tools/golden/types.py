"""ROS 2 types as `doppel interface show` prints them, with what rosidl derives from services and actions."""
import re
import subprocess
from dataclasses import dataclass, field

BASIC = {"bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
         "float32", "float64", "string", "wstring"}


@dataclass
class Field:
    name: str
    type: str           # a basic type, or a type's full name: std_msgs/msg/Header
    shape: str          # single, sequence, array
    size: int = 0       # of an array, or the bound of a sequence (0: none)
    text_bound: int = 0


@dataclass
class Type:
    name: str
    fields: list = field(default_factory=list)

    @property
    def package(self):
        return self.name.split("/")[0]


def split_type(text):
    """'string<=5[<=3]' -> ('string', 5, 'sequence', 3)"""
    match = re.fullmatch(r"([\w/]+?)(?:<=(\d+))?(\[(?:(<=)?(\d+))?\])?", text)
    if not match:
        raise ValueError(f"not a field type: {text}")
    base, text_bound, brackets, bounded, size = match.groups()
    shape = "single" if not brackets else "array" if size and not bounded else "sequence"
    return base, int(text_bound or 0), shape, int(size or 0)


class Types:
    """All types of the program, by full name."""

    def __init__(self, program):
        self.program = program
        self.by_name = {}
        kinds = {}
        for line in self._run("interface", "list").splitlines():
            if not line.startswith(" "):
                kind = line.rstrip(":")
                kinds[kind] = []
            else:
                kinds[kind].append(line.strip())
        for name in kinds["Messages"]:
            self._enter(name, self._show(name)[0])
        for name in kinds["Actions"]:
            self._action(name)
        for name in kinds["Services"]:
            if f"{name}_Request" not in self.by_name:
                for part, text in zip(("_Request", "_Response"), self._show(name)):
                    self._enter(name + part, text)

    def _run(self, *arguments):
        return subprocess.run([self.program, *arguments], check=True, capture_output=True, text=True).stdout

    def _show(self, name):
        return self._run("interface", "show", name).split("---\n")

    def _enter(self, name, text):
        """Adds a type and, from the indented lines below its fields, the types that it contains."""
        open_types = [Type(name)]
        self.by_name.setdefault(name, open_types[0])
        for line in text.splitlines():
            depth = len(line) - len(line.lstrip("\t"))
            words = line.split("#")[0].split()
            if not words or "=" in line and re.match(r"\s*\S+ +\w+ *=", line):
                continue
            base, text_bound, shape, size = split_type(words[0])
            if base not in BASIC:
                package, _, leaf = base.rpartition("/")
                base = base if package.count("/") else f"{package}/msg/{leaf}"
            owner = open_types[depth]
            owner.fields.append(Field(words[1], base, shape, size, text_bound))
            del open_types[depth + 1:]
            if base not in BASIC:
                open_types.append(Type(base))
                self.by_name.setdefault(base, open_types[-1])

    def _action(self, name):
        for part, text in zip(("_Goal", "_Result", "_Feedback"), self._show(name)):
            self._enter(name + part, text)
        goal_id = Field("goal_id", "unique_identifier_msgs/msg/UUID", "single")
        derived = {
            "_SendGoal_Request": [goal_id, Field("goal", name + "_Goal", "single")],
            "_SendGoal_Response": [Field("accepted", "bool", "single"),
                                   Field("stamp", "builtin_interfaces/msg/Time", "single")],
            "_GetResult_Request": [goal_id],
            "_GetResult_Response": [Field("status", "int8", "single"), Field("result", name + "_Result", "single")],
            "_FeedbackMessage": [goal_id, Field("feedback", name + "_Feedback", "single")]}
        for suffix, fields in derived.items():
            self.by_name[name + suffix] = Type(name + suffix, fields)

    def packages(self):
        return sorted({type.package for type in self.by_name.values()})
