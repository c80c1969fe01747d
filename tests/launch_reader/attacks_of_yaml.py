"""Whole launch files in YAML that are known to harm readers."""
import re

from attacks_of_xml import NO_LAUNCH_FILES
from hostile import PLAIN_VALUES, encoded

TAGS = (b"node", b"arg", b"let", b"include", b"executable", b"timer", b"log", b"group", b"set_env", b"append_env", b"unset_env",
        b"set_parameter", b"set_parameters_from_file", b"set_remap", b"set_use_sim_time", b"push_ros_namespace", b"shutdown",
        b"node_container", b"load_composable_node", b"gz_server", b"ros_gz_bridge")
ATTRIBUTES = {b"pkg": b"p", b"exec": b"e", b"name": b"n", b"value": b"v", b"file": b"f", b"cmd": b"c", b"period": b"1", b"from": b"a",
              b"to": b"b", b"namespace": b"s", b"filename": b"f"}
OTHER_ATTRIBUTES = (b"args", b"if", b"unless", b"cwd", b"message", b"default", b"description", b"scoped", b"reason", b"on_exit",
                    b"launch-delay", b"value-sep", b"type", b"allow_substs", b"target", b"plugin", b"separator")


def aliases_that_multiply(random, seed, name):
    levels, width = random.choice(((9, 9), (25, 2), (2, 300)))
    form = random.choice((
        b"- &a%d {group: {children: [%s]}}\n", b"- &a%d {node: {pkg: p, exec: e, param: [{name: a, value: [%s]}]}}\n",
        b"- &a%d {a: [%s]}\n", b"- &a%d {<<: [%s]}\n", b"- &a%d [%s]\n"))
    lines = [form % (i, b", ".join([b"*a%d" % (i - 1)] * width)) for i in range(1, levels + 1)]
    return b"launch:\n- &a0 {log: {message: lol}}\n" + b"".join(lines)


def alias_of_itself(random, seed, name):
    return b"launch:\n" + random.choice((
        b"- &a {group: {children: [*a]}}\n", b"- group: &a {children: *a}\n", b"- &a {node: *a}\n", b"- &a {arg: [*a]}\n",
        b"- node: &a {pkg: p, exec: e, param: [*a]}\n", b"- &a [*a]\n", b"- &a {? *a : b}\n", b"- &a {<<: *a}\n", b"&b\n- *b\n",
        b"- *nothing\n", b"- &a x\n- &a y\n- *a\n"))


def tags_of_python(random, seed, name):
    tag = random.choice((
        b"!!python/object/apply:os.system ['touch touched']", b"!!python/object/new:os.system ['touch touched']",
        b"!!python/name:os.system", b"!!python/module:os", b"!include canary.txt", b"!!binary 'YQ=='", b"!!int x", b"!!bool x",
        b"!!map [a]", b"!!seq {a: b}", b"!!str [a]", b"!<tag:yaml.org,2002:map> a", b"!e!x y", b"! a"))
    return random.choice((
        b"launch: %s\n", b"launch:\n- %s\n", b"launch:\n- log: %s\n", b"launch:\n- log: {message: %s}\n", b"%s : a\n",
        b"launch:\n- %s : a\n", b"launch:\n- node: {pkg: p, exec: e, args: %s}\n")) % tag


def keys_that_are_no_texts(random, seed, name):
    key = random.choice((b"? [a, b]\n: c", b"? {a: b}\n: c", b"? |\n  a\n: b", b"? a", b"[a]: b", b"{a: b}: c", b"*a : b", b"~: b",
                         b"1: b", b"'': b"))
    before = random.choice((b"", b"launch: []\n", b"launch:\n  ", b"launch:\n- ", b"launch:\n- group:\n    children:\n    - ",
                            b"launch:\n- node:\n    pkg: p\n    exec: e\n    "))
    indent = b" " * len(before.rpartition(b"\n")[2])
    return before + key.replace(b"\n", b"\n" + indent) + b"\n"


def yaml_that_is_deep(random, seed, name):
    depth = random.choice((20, 61, 300, 2000, 20_000))
    opening, closing = random.choice((
        (b"[", b"]"), (b"{a: ", b"}"), (b"- ", b""), (b"? ", b""), (b"{group: {children: [", b"]}}"), (b"{node: [", b"]}"),
        (b"{param: [", b"]}"), (b"!!map {a: ", b"}")))
    begin = random.choice((b"", b"launch: ", b"launch:\n- ", b"launch:\n- log: {message: ", b"launch:\n- node: {pkg: p, exec: e, param: "))
    return begin + opening * depth + closing * depth + b"\n"


def scalars_that_are_long(random, seed, name):
    part = random.choice((b"a", b"a ", b"'", b'"', b"\\", b"#", b": ", b"- ", b"\n", b"\n\n a", b"\xc3\xa9", b"!", b"&a", b"%"))
    return random.choice((
        b"launch:\n- log: {message: %s}\n", b'launch:\n- log: {message: "%s"}\n', b"launch:\n- log:\n    message: |\n      %s\n",
        b"launch:\n- %s: a\n", b"launch:\n- &%s a\n", b"launch: %s\n", b"%s: a\n", b"%%TAG ! %s\n---\nlaunch: []\n",
        b"# %s\nlaunch: []\n")) % (part * random.choice((1000, 60_000)))


def documents(random, seed, name):
    text = seed.decode(errors="replace")
    return random.choice((
        b"", b"\n", b"---\n", b"...\n", b"[]", b"{}", b"launch", b"launch:", b"launch: {}", b"launch: a", b"launch: [node]",
        b"launch: [a, [b], {c}]", b"launch: {node: a}", b"launch: [{node: [a, [b]]}]", b"launch: []\nlaunch: []\n", b"- launch:\n" + seed,
        b"---\n" + seed + b"---\nlaunch: []\n", b"%YAML 3.0\n---\n" + seed, b"%TAG ! tag:a:\n---\n" + seed, b"\xef\xbb\xbf" + seed,
        text.encode("utf-16"), text.encode("utf-32")))


def list_in_place_of_text(random, seed, name):
    """YAML permits it everywhere."""
    attributes = dict(ATTRIBUTES)
    attributes[random.choice((*ATTRIBUTES, *OTHER_ATTRIBUTES))] = random.choice((
        b"[a, b]", b"[]", b"['1', '$(nothing)']", b"['']", b"[~]", b"{a: b}", b"[[a]]", b"[{name: a, value: b}]"))
    return b"launch:\n- %s: {%s}\n" % (random.choice(TAGS), b", ".join(b"%s: %s" % one for one in attributes.items()))


def texts_that_double(random, seed, name):
    lines = [b"- let: {name: a%d, value: %s}\n" % (i, b"$(var a%d)" % (i - 1) * 4) for i in range(1, 25)]
    return b"launch:\n- let: {name: a0, value: lol}\n" + b"".join(lines)


def includes_of_no_launch_file(random, seed, name):
    file = random.choice((*NO_LAUNCH_FILES, b"canary.launch.yaml", b"canary.txt", b"\\0.launch.yaml"))
    return b"launch:\n" + b'- include: {file: "$(dirname)/%s"}\n' % file * random.choice((1, 1, 100))


def hostile_parameters(random, seed, name):
    """Values of many parameters, which are read as YAML: none of them has a substitution that could be refused."""
    values = [one.replace(b"\\", b"\\\\").replace(b'"', b'\\"')
              for one in map(encoded, random.sample(PLAIN_VALUES, 25)) if not re.search(rb"[\x00-\x1f\x7f]|\xef\xbf\xbf", one)]
    parameters = b"".join(b'    - {name: a%d, value: "%s"}\n' % one for one in enumerate(values))
    return b"launch:\n- node:\n    pkg: p\n    exec: e\n    param:\n" + parameters


ATTACKS = (
    aliases_that_multiply, aliases_that_multiply, alias_of_itself, tags_of_python, keys_that_are_no_texts, yaml_that_is_deep,
    scalars_that_are_long, documents, *3 * (list_in_place_of_text,), includes_of_no_launch_file, hostile_parameters, hostile_parameters)
COSTLY = (texts_that_double,)
