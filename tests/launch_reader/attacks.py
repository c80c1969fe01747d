"""Values and whole parts of launch files that are known to harm readers."""
import re

HOSTILE_BYTES = (b"\0", b"\0" * 100, b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x80" * 50,
                 b"\x1b[2J", b"\r", b"\t", b"\x85", b"\xe2\x80\xa8", b"<", b">", b"&", b"'", b'"', b"$(", b")", b"]]>", b"<!--", b"<![CDATA[",
                 b"<?xml version='1.0'?>", b"&#0;", b"&#xd800;", b"&lt;", b"- ", b": ", b"{", b"[", b"}", b"]", b"*a", b"&a ", b"!!", b"%", b"@", b"|\n",
                 b"? ", b"---\n", b"...\n", b"#")

# Texts in place of a value. {x} stands for a name of a file of the folder in world.py.
VALUES = (
    "", " ", "\n", "'", '"', "a'b", "\\", "\\$(", "$", "$(", "$()", "$( )", "$(var", "$(var)", "$(var a b c)", "$(var nothing)", "$(arg nothing)",
    "$(nothing x)", "$(nothing)", "$(var 'a)", "$(perform a b)", "$(text a b)", "$(closing a)", "$(eval1 1)", "$(class__)", "$(_class__)",
    "$(_class__ a b)", "$(_init__ a b)", "$(_dict__)", "$(_doc__ a)", "$(_getattribute__ a)", "$(_setattr__ ros1 a)", "$(-class--)",
    "$(eval)", "$(eval 1/0)", "$(eval 'a')", "$(eval nothing)", "$(eval ')", "$(eval \"1\" + 1)", "$(eval [1][5])", "$(eval {}['a'])", "$(eval \\0)",
    "$(env NOTHING_IS_SET)", "$(env)", "$(optenv)", "$(find-pkg-share)", "$(find-pkg-share nothing)", "$(find)", "$(find ..)", "$(find /etc)",
    "$(find-exec)", "$(exec-in-pkg a)", "$(anon)", "$(not)", "$(not maybe)", "$(and true)", "$(if maybe a b)", "$(eq a)", "$(command)",
    "$(command '')", "$(command ' ')", "$(command xacro)", "$(command 'xacro \"')", "$(command 'cat nothing')", "$(command 'cat \"')",
    "$(command 'cat folder.launch.xml')", "$(command 'cat $(dirname)/pipe.launch.xml')", "$(command 'cat $(dirname)/device.launch.xml')",
    "$(command 'touch $(dirname)/touched')", "$(command 'sh -c \"touch touched\"')", "$(file-content)", "$(file-content nothing)",
    "$(file-content $(dirname))", "$(file-content $(dirname)/pipe.launch.xml)", "$(file-content $(dirname)/device.launch.xml)",
    "$(file-content $(filename))", "$(dirname)", "$(dirname)/pipe.launch.xml", "$(dirname)/pipe.launch.yaml", "$(dirname)/pipe.launch.py",
    "$(dirname)/device.launch.xml", "$(dirname)/none.launch.xml", "$(dirname)/folder.launch.xml", "$(dirname)/nothing.launch.xml",
    "$(dirname)/nothing.launch.py", "$(dirname)/canary.txt", "$(dirname)/canary.launch.yaml", "$(filename)", "$(dirname)/multiplying.launch.xml",
    "$(dirname)/../config/parameters.yaml", "$(dirname)/../../../touched", "../touched", "/", ".", "..", "/absent/a/b", "/absent", "file:///etc/passwd",
    "package://arm_description/launch/inner.launch.xml", "true", "false", "maybe", "1", "-1", "0", "nan", ".nan", "inf", "-.inf", "1e999", "1e400",
    "-1e999", "1_000", "0x", "0b", "0o8", "0x" + "f" * 300, "9" * 25, "9" * 400, "9" * 5000, "0x" + "f" * 20000, "1:99:99", "1:1" * 300, ":".join("1" * 3000),
    "2024-13-45", "2024-01-01T99:99:99", "2024-01-01", "~", "null", "yes", "=", "<<", "[1, 2", "[a, {b: c}]", "{text: a, source: b}", "{a: {b: [1]}}",
    "{[a]: b}", "{{a: b}: c}", "{text: [a], source: 1, arguments: 3}", "*a", "&a [*a]", "&a {b: *a}", "[&a [x, x], &b [*a, *a], *b]", "!!bool x",
    "!!int ''", "!!float x", "!!timestamp x", "!!binary '%'", "!!null x", "!!set {a, b}", "!!omap [a: b]", "!!pairs [a: b]", "!!python/object:os.system {}",
    "!!python/name:os.system", "!include canary.txt", "!a b", "? a", "- a", "a: b", "a: b: c", "--- a\n--- b", "%YAML 9.9\n---\na", "# a", "\t", "|", "\x00",
    '"\\ud800"', '"\\0"', '"\\U00110000"', '["\\udfff"]', "\ud7ff", "\uffff", "\u2028", "\u0085", "\x7f", "\x1b[2J", "ros_params", "global_params",
    "ros_remaps", "ros_namespace", "<robot name='a'/>", "<robot", "&amp;", "&e;", "%s %d {0} {", "a;b;;c", "--ros-args", "-p k:=", "k:=v", ":=", "/" * 300,
    "a" * 300, "a/" * 3000, "é" * 300, "rate", "who", "robot_description", "p_semantic", "double", "int", "yaml", "shutdown")


def hostile_value(random):
    kind = random.random()
    if kind < 0.9:
        return random.choice(VALUES).encode("utf-8", "surrogatepass")
    length = random.choice((1000, 100_000))
    if kind < 0.93:
        return random.choice((b"a", b"\xc3\xa9", b"'", b'"', b"$(", b"(", b"[", b"{", b"\\", b" ", b"&", b"a: ", b"- ", b"[a, ")) * length
    depth = random.choice((5, 19, 25, 300, 5000))
    opening, closing = random.choice(((b"$(var ", b")"), (b"$(eval ", b")"), (b"$(not ", b")"), (b"[", b"]"), (b"{a: ", b"}"), (b"'", b"'"),
                                      (b"$(eval '", b"')"), (b"$(var a ", b")"), (b"(", b")")))
    return opening * depth + b"1" + closing * depth


def after_root(seed, part):
    """Puts a part behind the first tag of an element."""
    root = seed.find(b"<launch>")
    return seed[:root + 8] + part + seed[root + 8:] if root >= 0 else b"<launch>" + part + b"</launch>"


def with_type(seed, declaration, part):
    """Puts a document type before the root, and a part into it."""
    seed = after_root(seed, part)
    root = seed.find(b"<launch>")
    return seed[:root] + declaration + b"\n" + seed[root:]


def uses_of_entity(random, name):
    return random.choice((b"<rosparam>&%s;</rosparam>", b'<arg name="%s" default="&%s;"/>' % (name, name) + b"<!-- %s -->", b'<log message="&%s;"/>',
                          b"&%s;", b"<rosparam param='a'>&%s;&%s;</rosparam>" % (name, name) + b"<!-- %s -->",
                          b'<param name="a" value="&%s;"/>', b'<node pkg="p" exec="e"><param name="a" value="&%s;"/></node>')) % name


def entities_that_multiply(random, seed, name):
    levels, width = random.choice(((9, 10), (30, 2), (3, 400), (2, 3000)))
    declared = b'<!ENTITY e0 "lol">' + b"".join(
        b'<!ENTITY e%d "%s">' % (i, b"&e%d;" % (i - 1) * width) for i in range(1, levels + 1))
    return with_type(seed, b"<!DOCTYPE launch [%s]>" % declared, uses_of_entity(random, b"e%d" % levels))


def long_entity_that_repeats(random, seed, name):
    declared = b'<!ENTITY e "%s">' % (random.choice((b"a", b"a\n", b"<group/>")) * random.choice((1000, 30_000)))
    return with_type(seed, b"<!DOCTYPE launch [%s]>" % declared, uses_of_entity(random, b"e") * 40)


def entity_of_elements(random, seed, name):
    content = random.choice((b"<node pkg='p' exec='e'/>", b"<group>&e;</group>", b"<group>", b"</group>", b"$(var ", b"<include file='$(filename)'/>"))
    return with_type(seed, b'<!DOCTYPE launch [<!ENTITY e "%s">]>' % content, b"&e;" * random.choice((1, 100)))


def entity_of_file(random, seed, name):
    file = random.choice((b"file:///etc/passwd", b"/etc/passwd", b"canary.txt", b"canary.dtd", b"pipe.launch.xml", b"/dev/zero", b"http://localhost/"))
    declared = random.choice((
        b'<!DOCTYPE launch [<!ENTITY e SYSTEM "%s">]>', b'<!DOCTYPE launch [<!ENTITY e PUBLIC "a" "%s">]>', b'<!DOCTYPE launch SYSTEM "%s">',
        b'<!DOCTYPE launch PUBLIC "a" "%s">', b'<!DOCTYPE launch [<!ENTITY %% p SYSTEM "%s"> %%p;]>',
        b'<!DOCTYPE launch [<!ENTITY %% p SYSTEM "%s"><!ENTITY %% q "<!ENTITY e SYSTEM \'%%p;\'>"> %%q;]>',
        b'<!DOCTYPE launch [<!NOTATION n SYSTEM "a"><!ENTITY e SYSTEM "%s" NDATA n>]>')) % file
    return with_type(seed, declared, uses_of_entity(random, b"e"))


def attribute_declarations(random, seed, name):
    declared = random.choice((b'<!ATTLIST node pkg CDATA "p" a CDATA #IMPLIED>', b"<!ELEMENT launch (node*)>", b"<!ATTLIST launch a ID #REQUIRED>",
                              b'<!ATTLIST group if CDATA "maybe">', b"<!ELEMENT launch " + b"(" * 5000 + b"a" + b")" * 5000 + b">"))
    return with_type(seed, b"<!DOCTYPE launch [%s]>" % declared, b"")


def file_by_instruction(random, seed, name):
    return after_root(seed, random.choice((
        b'<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="canary.txt" parse="text"/>', b'<?xml-stylesheet href="canary.txt"?>',
        b'<rosparam file="canary.txt"/>', b"<?php include 'canary.txt' ?>")))


def unknown_encoding(random, seed, name):
    encoding = random.choice((b"utf-16", b"utf-7", b"latin-1", b"ascii", b"cp1252", b"nothing", b"", b"utf-32", b"idna", b"rot13", b"hex", b"shift_jis",
                              b"unicode_escape", b"undefined", b"x" * 5000))
    rest = seed[seed.find(b"<launch>"):]
    if random.random() < 0.3:
        rest = rest.decode(errors="replace").encode(random.choice(("utf-16", "utf-32", "utf-16-le", "utf-7")))
    return b'<?xml version="1.0" encoding="' + encoding + b'"?>\n' + rest


def xml_that_is_deep(random, seed, name):
    depth = random.choice((50, 61, 300, 5000, 60_000))
    tag, inner = random.choice(((b"group", b""), (b"param name='a'", b""), (b"timer period='1'", b""), (b"node pkg='p' exec='e' type='t'", b""), (b"a", b"b"),
                                (b"include file='$(dirname)/inner.launch.xml'", b""), (b"node pkg='p' exec='e'", b"<param name='a'>" * 300 + b"</param>" * 300)))
    return after_root(seed, b"<%s>" % tag * depth + inner + b"</%s>" % tag.split()[0] * depth)


def many_attributes(random, seed, name):
    count = random.choice((100, 20_000))
    tag = random.choice((b"node pkg='p' exec='e' type='t'", b"gz_server", b"gz_spawn_model", b"log", b"group"))
    return after_root(seed, b"<%s %s/>" % (tag, b" ".join(b'a%d="b"' % i for i in range(count))))


def texts_that_double(random, seed, name):
    let = random.choice((b'<let name="a%d" value="%s"/>', b'<arg name="a%d" default="%s"/>', b'<arg name="a%d" value="%s"/>'))
    use = b"$(arg a%d)" if name.endswith(".launch") else b"$(var a%d)"
    return after_root(seed, let % (0, b"lol") + b"".join(let % (i, use % (i - 1) * 4) for i in range(1, 25)))


def records_that_multiply(random, seed, name):
    count = random.choice((30, 450))
    kind = random.choice((b'<set_env name="a%d" value="b"/>', b'<set_parameter name="a%d" value="b"/>', b'<set_remap from="a%d" to="b"/>', b'<env name="a%d" value="b"/>'))
    node = b'<node pkg="p" type="t" name="n"/>' if name.endswith(".launch") else b'<node pkg="p" exec="e"/>'
    return after_root(seed, b"".join(kind % i for i in range(count)) + node * count)


def includes_that_multiply(random, seed, name):
    file = random.choice((b"$(dirname)/multiplying.launch.xml", b"$(filename)", b"$(dirname)/inner.launch.xml", b"$(dirname)/every.launch.xml"))
    return after_root(seed, b'<include file="%s"/>' % file * random.choice((1, 2, 30)))


def aliases_that_multiply(random, seed, name):
    levels, width = random.choice(((9, 9), (25, 2), (2, 300)))
    form = random.choice((b"- &a%d {group: {children: [%s]}}\n", b"- &a%d {node: {pkg: p, exec: e, param: [{name: a, value: [%s]}]}}\n",
                          b"- &a%d {a: [%s]}\n", b"- &a%d {<<: [%s]}\n", b"- &a%d [%s]\n"))
    lines = [b"- &a0 {log: {message: lol}}\n"]
    lines += [form % (i, b", ".join([b"*a%d" % (i - 1)] * width)) for i in range(1, levels + 1)]
    return b"launch:\n" + b"".join(lines)


def alias_of_itself(random, seed, name):
    return b"launch:\n" + random.choice((
        b"- &a {group: {children: [*a]}}\n", b"- &a [*a]\n", b"- &a {? *a : b}\n", b"- &a {node: *a}\n", b"- group: &a {children: *a}\n", b"&b\n- *b\n",
        b"- &a {<<: *a}\n", b"- node: &a {pkg: p, exec: e, param: [*a]}\n", b"- &a {arg: [*a]}\n", b"- *nothing\n", b"- &a x\n- &a y\n- *a\n"))


def tags_of_python(random, seed, name):
    tag = random.choice((b"!!python/object/apply:os.system ['touch touched']", b"!!python/name:os.system", b"!!python/module:os", b"!include canary.txt",
                         b"!!python/object/new:os.system ['touch touched']", b"!!binary 'YQ=='", b"!!int x", b"!!bool x", b"!!map [a]", b"!!seq {a: b}", b"!!str [a]",
                         b"!<tag:yaml.org,2002:map> a", b"!e!x y", b"! a"))
    return random.choice((b"launch: %s\n", b"launch:\n- %s\n", b"launch:\n- log: %s\n", b"launch:\n- log: {message: %s}\n", b"%s : a\n",
                          b"launch:\n- %s : a\n", b"launch:\n- node: {pkg: p, exec: e, args: %s}\n")) % tag


def keys_that_are_none(random, seed, name):
    key = random.choice((b"? [a, b]\n  : c", b"? {a: b}\n  : c", b"[a]: b", b"~: b", b"1: b", b"? a", b"? |\n    a\n  : b", b"'': b", b"{a: b}: c", b"*a : b"))
    return random.choice((b"launch:\n- %s\n", b"launch:\n- node:\n    pkg: p\n    exec: e\n    %s\n", b"%s\n", b"launch:\n  %s\n", b"launch:\n- group:\n    children:\n    - %s\n",
                          b"launch: []\n%s\n")) % key.replace(b"\n", b"\n    ")


def yaml_that_is_deep(random, seed, name):
    depth = random.choice((20, 61, 300, 2000, 20_000))
    opening, closing = random.choice(((b"[", b"]"), (b"{group: {children: [", b"]}}"), (b"{a: ", b"}"), (b"- ", b""), (b"{node: [", b"]}"), (b"? ", b""),
                                      (b"{param: [", b"]}"), (b"!!map {a: ", b"}")))
    return random.choice((b"launch:\n- ", b"", b"launch: ", b"launch:\n- log: {message: ", b"launch:\n- node: {pkg: p, exec: e, param: ")) + opening * depth + closing * depth + b"\n"


def scalars_that_are_long(random, seed, name):
    value = random.choice((b"a", b"a ", b"'", b'"', b"\\", b"#", b": ", b"- ", b"\n", b"\n\n a", b"\xc3\xa9", b"!", b"&a", b"%")) * random.choice((1000, 60_000))
    return random.choice((b"launch:\n- log: {message: %s}\n", b'launch:\n- log: {message: "%s"}\n', b"launch:\n- log:\n    message: |\n      %s\n", b"%s: a\n",
                          b"launch:\n- %s: a\n", b"launch:\n- &%s a\n", b"launch: %s\n", b"%%TAG ! %s\n---\nlaunch: []\n", b"# %s\nlaunch: []\n")) % value


def documents(random, seed, name):
    return random.choice((b"---\n" + seed + b"---\nlaunch: []\n", b"%YAML 3.0\n---\n" + seed, b"%TAG ! tag:a:\n---\n" + seed, b"", b"\n", b"---\n", b"...\n", b"[]", b"launch",
                          b"launch:", b"launch: {}", b"launch: a", b"launch: [a, [b], {c}]", b"launch: {node: a}", b"{}", b"launch: []\nlaunch: []\n", b"\xef\xbb\xbf" + seed,
                          seed.decode(errors="replace").encode("utf-16"), seed.decode(errors="replace").encode("utf-32"), b"launch: [node]", b"launch: [{node: [a, [b]]}]",
                          b"launch:\n- node: {pkg: [a, b], exec: [c], name: [d], args: [e, f], if: [true], namespace: [g]}\n", b"- launch:\n" + seed))


def yaml_lists(random, seed, name):
    """A list in place of a text, which YAML permits everywhere."""
    key = random.choice((b"pkg", b"exec", b"name", b"namespace", b"args", b"if", b"cwd", b"file", b"cmd", b"period", b"value", b"message", b"from", b"to", b"filename",
                         b"default", b"description", b"scoped", b"reason", b"on_exit", b"launch-delay", b"value-sep", b"type", b"allow_substs", b"target", b"plugin", b"separator"))
    tag = random.choice((b"node", b"arg", b"let", b"include", b"executable", b"timer", b"log", b"set_env", b"append_env", b"unset_env", b"set_parameter", b"set_remap", b"group",
                         b"push_ros_namespace", b"shutdown", b"node_container", b"load_composable_node", b"gz_server", b"ros_gz_bridge", b"set_parameters_from_file", b"set_use_sim_time"))
    rest = {b"pkg": b"p", b"exec": b"e", b"name": b"n", b"value": b"v", b"file": b"f", b"cmd": b"c", b"period": b"1", b"from": b"a", b"to": b"b", b"namespace": b"s", b"filename": b"f"}
    rest[key] = random.choice((b"[a, b]", b"[]", b"['1', '$(nothing)']", b"['']", b"[~]", b"{a: b}", b"[[a]]", b"[{name: a, value: b}]"))
    return b"launch:\n- %s: {%s}\n" % (tag, b", ".join(b"%s: %s" % one for one in rest.items()))


def yaml_texts_that_double(random, seed, name):
    lines = [b"- let: {name: a0, value: lol}\n"] + [b"- let: {name: a%d, value: %s}\n" % (i, b"$(var a%d)" % (i - 1) * 4) for i in range(1, 25)]
    return b"launch:\n" + b"".join(lines)


NO_LAUNCH_FILES = (b"pipe.launch.yaml", b"pipe.launch.xml", b"pipe.launch.py", b"device.launch.xml", b"folder.launch.xml", b"none.launch.xml", b"canary.launch.yaml",
                   b"canary.txt", b"nothing.launch.yaml", b"nothing.launch.py", b"../launch", b"", b"a" * 300, b"\xc3\xa9" * 3000)


def includes_of_no_launch_file(random, seed, name):
    file, count = random.choice(NO_LAUNCH_FILES), random.choice((1, 1, 100))
    if name.endswith(".yaml"):
        return b"launch:\n" + b'- include: {file: "$(dirname)/%s"}\n' % file.replace(b"canary", random.choice((b"canary", b"\\0"))) * count
    element = random.choice((b'<include file="$(dirname)/%s"/>', b'<include file="$(dirname)/%s"/>', b'<param name="a" textfile="$(dirname)/%s"/>',
                             b'<node pkg="p" exec="e"><param from="$(dirname)/%s" allow_substs="true"/></node>',
                             b'<rosparam command="load" file="$(dirname)/%s"/>'))
    return after_root(seed, element % file.replace(b"canary", b"none") * count)


def hostile_parameters(random, seed, name):
    """Values of many parameters, which are read as YAML: none of them has a substitution that could be refused."""
    values = [one.encode("utf-8", "surrogatepass") for one in random.sample([one for one in VALUES if "$(" not in one], 25)]
    if name.endswith(".yaml"):
        texts = [b'"%s"' % one.replace(b"\\", b"\\\\").replace(b'"', b'\\"') for one in values if not re.search(rb"[\x00-\x1f\x7f]|\xef\xbf\xbf", one)]
        return b"launch:\n- node:\n    pkg: p\n    exec: e\n    param:\n" + b"".join(b"    - {name: a%d, value: %s}\n" % one for one in enumerate(texts))
    texts = [one.replace(b"&", b"&amp;").replace(b"<", b"&lt;").replace(b'"', b"&quot;") for one in values if not re.search(rb"[\x00-\x08\x0e-\x1f]|\xef\xbf\xbf", one)]
    kind = random.choice((b"", b' type="str"', b' type="int"', b' type="double"', b' type="bool"', b' type="yaml"', b' value-sep=";"'))
    inner = b"".join(b'<param name="a%d" value="%s"%s/>' % (*one, kind) for one in enumerate(texts))
    inner += b"".join(b"<rosparam param='b'>%s</rosparam>" % one for one in texts) if name.endswith(".launch") else b""
    return after_root(seed, inner if name.endswith(".launch") else b'<node pkg="p" exec="e">%s</node>' % inner)


ATTACKS = {
    "xml": (entities_that_multiply, entity_of_elements, entity_of_file, entity_of_file, attribute_declarations, file_by_instruction,
            unknown_encoding, xml_that_is_deep, many_attributes, includes_of_no_launch_file, hostile_parameters, hostile_parameters),
    "yaml": (aliases_that_multiply, aliases_that_multiply, alias_of_itself, tags_of_python, keys_that_are_none, yaml_that_is_deep, scalars_that_are_long, documents,
             yaml_lists, yaml_lists, yaml_lists, includes_of_no_launch_file, hostile_parameters, hostile_parameters),
}
# Those that end at a bound after a second; one of them in so many attacks.
COSTLY_ATTACKS = {"xml": (long_entity_that_repeats, texts_that_double, records_that_multiply, includes_that_multiply), "yaml": (yaml_texts_that_double,)}
COSTLY_ONE_IN = 25
