"""Bytes and values that are known to harm readers of launch files."""

HOSTILE_BYTES = (
    # These are no UTF-8, or no characters of a text.
    b"\0", b"\0" * 100, b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x80" * 50,
    b"\x1b[2J", b"\r", b"\t", b"\x85", b"\xe2\x80\xa8",
    # These have a meaning in XML.
    b"<", b">", b"&", b"'", b'"', b"]]>", b"<!--", b"<![CDATA[", b"<?xml version='1.0'?>", b"&#0;", b"&#xd800;", b"&lt;",
    # These have a meaning in YAML and in substitutions.
    b"- ", b": ", b"{", b"[", b"}", b"]", b"*a", b"&a ", b"!!", b"%", b"@", b"|\n", b"? ", b"---\n", b"...\n", b"#", b"$(", b")")

SUBSTITUTIONS = (
    "$", "$(", "$()", "$( )", "\\$(", "$(var", "$(var)", "$(var a b c)", "$(var nothing)", "$(var 'a)", "$(arg nothing)", "$(nothing)",
    "$(nothing x)", "$(env)", "$(env NOTHING_IS_SET)", "$(optenv)", "$(find)", "$(find ..)", "$(find /etc)", "$(find-pkg-share)",
    "$(find-pkg-share nothing)", "$(find-exec)", "$(exec-in-pkg a)", "$(anon)", "$(not)", "$(not maybe)", "$(and true)", "$(eq a)",
    "$(if maybe a b)", "$(dirname)", "$(filename)", "$(file-content)", "$(file-content nothing)", "$(file-content $(filename))",
    # The reader has methods of these names.
    "$(perform a b)", "$(text a b)", "$(closing a)", "$(eval1 1)", "$(class__)", "$(_class__)", "$(_class__ a b)", "$(_init__ a b)",
    "$(_dict__)", "$(_doc__ a)", "$(_getattribute__ a)", "$(_setattr__ ros1 a)", "$(-class--)",
    # These expressions and commands fail, or would change something.
    "$(eval)", "$(eval 1/0)", "$(eval 'a')", "$(eval nothing)", "$(eval ')", "$(eval \"1\" + 1)", "$(eval [1][5])", "$(eval {}['a'])",
    "$(eval \\0)", "$(command)", "$(command '')", "$(command ' ')", "$(command xacro)", "$(command 'xacro \"')", "$(command 'cat \"')",
    "$(command 'cat nothing')", "$(command 'touch $(dirname)/touched')", "$(command 'sh -c \"touch touched\"')",
    # These files wait, have no end, or are none.
    *(form.replace("FILE", f"$(dirname)/{name}.launch.xml")
      for form in ("FILE", "$(file-content FILE)", "$(command 'cat FILE')") for name in ("pipe", "device", "folder", "none")))

PATHS = (
    "$(dirname)/pipe.launch.yaml", "$(dirname)/pipe.launch.py", "$(dirname)/nothing.launch.xml", "$(dirname)/nothing.launch.py",
    "$(dirname)/canary.txt", "$(dirname)/canary.launch.yaml", "$(dirname)/multiplying.launch.xml", "$(dirname)/../config/parameters.yaml",
    "$(dirname)/../../../touched", "../touched", "/", ".", "..", "/absent", "/absent/a/b", "file:///etc/passwd",
    "package://arm_description/launch/inner.launch.xml", "/" * 300, "a" * 300, "a/" * 3000, "é" * 300)

SCALARS = (
    "", " ", "\n", "true", "false", "maybe", "yes", "null", "~", "=", "<<", "'", '"', "a'b", "\\", "|", "\t", "# a",
    "%s %d {0} {", "a;b;;c",
    # These are numbers and dates in one of the languages, or look like them.
    "0", "1", "-1", "nan", ".nan", "inf", "-.inf", "1e999", "1e400", "-1e999", "1_000", "0x", "0b", "0o8", "0x" + "f" * 300,
    "0x" + "f" * 20000, "9" * 25, "9" * 400, "9" * 5000, "1:99:99", "1:1" * 300, ":".join("1" * 3000), "2024-01-01", "2024-13-45",
    "2024-01-01T99:99:99",
    # These are no characters, or none that can be shown.
    "\x00", "\x7f", "\x1b[2J", "\u0085", "\u2028", "\ud7ff", "\uffff", '"\\ud800"', '"\\0"', '"\\U00110000"', '["\\udfff"]',
    # These mean something to launch or to the reader.
    "rate", "who", "ros_params", "global_params", "ros_remaps", "ros_namespace", "robot_description", "p_semantic", "double", "int", "yaml",
    "shutdown", "--ros-args", "-p k:=", "k:=v", ":=", "<robot name='a'/>", "<robot", "&amp;", "&e;")

YAML_VALUES = (
    "[1, 2", "[a, {b: c}]", "{a: {b: [1]}}", "{[a]: b}", "{{a: b}: c}", "{text: a, source: b}", "{text: [a], source: 1, arguments: 3}",
    "? a", "- a", "a: b", "a: b: c", "--- a\n--- b", "%YAML 9.9\n---\na",
    "*a", "&a [*a]", "&a {b: *a}", "[&a [x, x], &b [*a, *a], *b]",
    "!!bool x", "!!int ''", "!!float x", "!!timestamp x", "!!binary '%'", "!!null x", "!!set {a, b}", "!!omap [a: b]", "!!pairs [a: b]",
    "!!python/object:os.system {}", "!!python/name:os.system", "!include canary.txt", "!a b")

PLAIN_VALUES = SCALARS + YAML_VALUES  # without a substitution
VALUES = SUBSTITUTIONS + PATHS + PLAIN_VALUES

REPEATED = (b"a", b"\xc3\xa9", b"'", b'"', b"$(", b"(", b"[", b"{", b"\\", b" ", b"&", b"a: ", b"- ", b"[a, ")
BRACKETS = ((b"$(var ", b")"), (b"$(var a ", b")"), (b"$(eval ", b")"), (b"$(eval '", b"')"), (b"$(not ", b")"), (b"(", b")"), (b"[", b"]"),
            (b"{a: ", b"}"), (b"'", b"'"))


def encoded(value):
    return value.encode("utf-8", "surrogatepass")


def hostile_value(random):
    kind = random.random()
    if kind < 0.9:
        return encoded(random.choice(VALUES))
    if kind < 0.93:
        return random.choice(REPEATED) * random.choice((1000, 100_000))
    depth = random.choice((5, 19, 25, 300, 5000))
    opening, closing = random.choice(BRACKETS)
    return opening * depth + b"1" + closing * depth
