"""Reads the shape of C++ files without a compiler: comments, code without comments and literals, functions with their
lengths. Used by tools/check_shape and tools/measure_source.

The scanner knows braces, parentheses and the heads in front of braces, not the language; it expects code as clang-format
writes it.
"""
import dataclasses
import pathlib
import re
import subprocess

CPP = (".h", ".cpp")
# Raw strings come first, then comments, strings and characters; an apostrophe between digits separates thousands.
HIDDEN = re.compile(
    r'R"(?P<mark>[^()\s\\"]{0,16})\(.*?\)(?P=mark)"|//[^\n]*|/\*.*?\*/|'
    r'"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'',
    re.DOTALL)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE)
MARKS = re.compile(r"[{}();]")
LABEL = re.compile(r"\s*(?:template\s*<(?:[^<>]|<[^<>]*>)*>\s*(?:requires\s*\((?:[^()]|\([^()]*\))*\)\s*)?|"
                   r"(?:public|protected|private)\s*:\s*|\[\[[^\]]*\]\]\s*|DOPPEL_[A-Z_]+\([^)]*\)\s*)*")
TYPE_HEAD = re.compile(r"(?:typedef\s+)?(?:class|struct|union|enum)\b")
SPACE_HEAD = re.compile(r"(?:inline\s+)?namespace\b|extern\s*$")
ARGUMENTS, VALUE = "\1", "\2"  # stand for a pair of parentheses and of braces
TEST = re.compile(r"TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)")
NAME = re.compile(r"((?:[\w~]+\s*::\s*)*(?:operator\s*[^\s\w(]+|operator\s*\(\)|operator\b[^(]*|~?\w+))\s*\(")


@dataclasses.dataclass
class Function:
    name: str
    line: int  # of its head, from 1
    lines: int  # from the head to the closing brace, both included


@dataclasses.dataclass
class Comment:
    line: int  # from 1
    text: str  # without the slashes
    alone: bool  # no code stands before it on its line


def blank(text):
    return re.sub(r"[^\n]", " ", text)


def code_and_comments(text):
    """The text with blanks for comments, literals and preprocessor directives, and the list of `//` comments."""
    comments = []

    def hide(found):
        hidden = found.group()
        if hidden.startswith("//"):
            start = text.rfind("\n", 0, found.start()) + 1
            comments.append(Comment(text.count("\n", 0, found.start()) + 1, hidden[2:].strip(),
                                    not text[start:found.start()].strip()))
        return blank(hidden)

    return DIRECTIVE.sub(lambda found: blank(found.group()), HIDDEN.sub(hide, text)), comments


def without(pattern, instead, text):
    """Removes nested pairs from the inside out."""
    before = None
    while before != text:
        before, text = text, re.sub(pattern, instead, text)
    return text


def plain(head):
    """A head without template arguments, labels and the contents of braces."""
    head = LABEL.sub("", head, count=1).replace("->", "  ")
    return without(r"\{[^{}]*\}", VALUE, without(r"<[^<>]*>", "", head)).strip()


def kind_of(head):
    """What the brace after this plain head opens: 'space', 'type', 'function' or 'value'."""
    if SPACE_HEAD.match(head):
        return "space"
    flat = without(r"\([^()]*\)", ARGUMENTS, head)
    if TYPE_HEAD.match(head) and ARGUMENTS not in flat:
        return "type"
    if ARGUMENTS not in flat or "=" in flat.split("operator")[0]:
        return "value"
    # In a list of initialisers `member{` is a value; the body of a constructor follows a parenthesis or a brace.
    if re.search(ARGUMENTS + r"[^:]*(?<!:):(?!:)", flat) and re.search(r"\w$", flat):
        return "value"
    return "function"


def name_of(head):
    test = TEST.match(head)
    if test:
        return ".".join(test.groups())
    named = NAME.search(head)
    return re.sub(r"\s+", " ", named.group(1) if named else head)


def functions(code):
    """Functions with a body in `code`, from code_and_comments(); a lambda belongs to the function around it."""
    out, scopes, parentheses = [], [], 0
    start = 0  # of the statement in progress
    inside = None  # the function in progress, and its depth
    for mark in MARKS.finditer(code):
        letter = mark.group()
        if letter == "{":
            kind = "value"
            if inside is None and parentheses == 0 and scopes[-1:] != ["value"]:
                head = plain(code[start:mark.start()])
                kind = kind_of(head)
            scopes.append(kind)
            if kind == "function":
                first = LABEL.match(code, start).end()
                inside = (name_of(head), code.count("\n", 0, first) + 1)
            elif kind in ("space", "type"):
                start = mark.end()
        elif letter == "}":
            kind = scopes.pop() if scopes else "space"
            if kind == "function":
                name, line = inside
                out.append(Function(name, line, code.count("\n", 0, mark.end()) + 1 - line + 1))
                inside = None
            if kind != "value":
                start, parentheses = mark.end(), 0
        elif inside is not None:
            continue
        elif letter == "(":
            parentheses += 1
        elif letter == ")":
            parentheses -= 1
        elif "value" not in scopes and parentheses <= 0:
            start, parentheses = mark.end(), 0
    return out


def tracked_files(root):
    """Paths of the files in git below `root`, relative to it; of all files where there is no git."""
    listed = subprocess.run(["git", "-C", str(root), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            capture_output=True, text=True)
    if listed.returncode == 0:
        names = [pathlib.PurePosixPath(name) for name in listed.stdout.split("\0") if name]
    else:
        names = [pathlib.PurePosixPath(path.relative_to(root).as_posix()) for path in root.rglob("*") if path.is_file()]
    return sorted(name for name in names if (root / name).is_file())
