"""Mutations of launch files: what a broken file, or one of somebody who wants to do harm, can have in place of what is expected.

`mutated(random, seed, others)` changes a file at a few places. A notation finds the places: elements that are removed, repeated
and nested, attributes that are removed, repeated, renamed and get other values.
"""
import re

import attacks_of_xml
import attacks_of_yaml
from hostile import HOSTILE_BYTES, hostile_value

MAX_CHANGES = 3
ATTACKS = 0.25  # of the mutations; the others are changes of a seed
COSTLY = 0.04   # of the attacks: those that end at a bound after a second


class Xml:
    ATTRIBUTE = re.compile(rb'\s([\w:.-]+)="([^"]*)"')
    TAG = re.compile(rb"<(/?)([A-Za-z_][\w:.-]*)[^<>]*?(/?)>")

    def attributes(self, data):
        """(begin, end) of each attribute, of its name and of its value."""
        return [(one.span(), one.span(1), one.span(2)) for one in self.ATTRIBUTE.finditer(data)]

    def elements(self, data):
        """(begin, end) of each element below the root."""
        out, stack = [], []
        for tag in self.TAG.finditer(data):
            if not tag[1]:
                stack.append(tag)
            if (tag[1] or tag[3]) and stack:
                begin = stack.pop().start()
                if stack:
                    out.append((begin, tag.end()))
        return out

    def names(self, data):
        """(begin, end) of the name of each element."""
        return [one.span(2) for one in self.TAG.finditer(data) if not one[1]]

    def quoted(self, value, random):
        if random.random() < 0.1:  # as it is, which breaks the file
            return value
        return value.replace(b"&", b"&amp;").replace(b"<", b"&lt;").replace(b'"', b"&quot;")

    def attribute(self, name, value, random):
        return b' %s="%s"' % (name, self.quoted(value, random))

    def nested(self, element, depth, name):
        return b"<%s>" % name * depth + element + b"</%s>" % name * depth


class Yaml:
    # Keys with a scalar behind them, in lines and in braces.
    ATTRIBUTE = re.compile(rb"(?<=[\n{,\-] )\s*([\w-]+): ([^\s{\[,}\]][^\n{}\[\],]*)")
    ITEM = re.compile(rb"^( *)- .*\n(?:\1 .*\n)*", re.MULTILINE)
    NAME = re.compile(rb"^ *- ([\w-]+):", re.MULTILINE)

    def attributes(self, data):
        return [(one.span(), one.span(1), one.span(2)) for one in self.ATTRIBUTE.finditer(data)]

    def elements(self, data):
        out, position = [], 0
        while one := self.ITEM.search(data, position):
            out.append(one.span())
            position = data.index(b"\n", one.start())  # items inside of it follow
        return out

    def names(self, data):
        return [one.span(1) for one in self.NAME.finditer(data)]

    def quoted(self, value, random):
        form = random.random()
        if form < 0.2:
            return value
        if form < 0.6:
            return b"'" + value.replace(b"'", b"''") + b"'"
        return b'"' + value.replace(b"\\", b"\\\\").replace(b'"', b'\\"').replace(b"\n", b"\\n") + b'"'

    def attribute(self, name, value, random):
        return b", %s: %s" % (name, self.quoted(value, random))

    def nested(self, element, depth, name):
        indent = b" " * (len(element) - len(element.lstrip(b" ")))
        depth = min(depth, 70)  # each level of lines is indented; yaml_that_is_deep() has braces
        lines = [indent + b"    " * i + b"- %s:\n" % name + indent + b"    " * i + b"    children:\n" for i in range(depth)]
        return b"".join(lines) + b"".join(b"    " * depth + line for line in element.splitlines(True))


NOTATIONS = {".xml": Xml(), ".launch": Xml(), ".yaml": Yaml()}


def mutated(random, name, seed, others):
    """The changed bytes of a file, and what was done. `others` are files of its notation, whose parts are put into it."""
    notation = NOTATIONS[name[name.rindex("."):]]
    if random.random() < ATTACKS:
        attacks = attacks_of_yaml if isinstance(notation, Yaml) else attacks_of_xml
        attack = random.choice(attacks.COSTLY if random.random() < COSTLY else attacks.ATTACKS)
        return attack(random, seed, name), attack.__name__
    data, done = seed, []
    for _ in range(random.randint(1, MAX_CHANGES)):
        change = random.choice(CHANGES)
        data = change(random, notation, data, others)
        done.append(change.__name__)
    return data, ", ".join(done)


def replaced(data, span, by):
    return data[:span[0]] + by + data[span[1]:]


def flip_bytes(random, notation, data, others):
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        if out:
            out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def remove_bytes(random, notation, data, others):
    begin = random.randint(0, len(data))
    return data[:begin] + data[begin + random.choice((1, 4, 50, len(data))):]


def repeat_bytes(random, notation, data, others):
    begin = random.randint(0, len(data))
    part = data[begin:begin + random.choice((1, 4, 50, 500))]
    return data[:begin] + part * random.choice((2, 3, 100)) + data[begin + len(part):]


def insert_bytes(random, notation, data, others):
    place = random.randint(0, len(data))
    return data[:place] + random.choice(HOSTILE_BYTES) + data[place:]


def of_attributes(change):
    """A change of one attribute; nothing where there is none."""
    def changed(random, notation, data, others):
        found = notation.attributes(data)
        return change(random, notation, data, random.choice(found), others) if found else data

    changed.__name__ = change.__name__
    return changed


@of_attributes
def change_value(random, notation, data, attribute, others):
    return replaced(data, attribute[2], notation.quoted(hostile_value(random), random))


@of_attributes
def put_into_value(random, notation, data, attribute, others):
    begin, end = attribute[2]
    place = random.randint(begin, end)
    return data[:place] + notation.quoted(hostile_value(random), random) + data[place:]


@of_attributes
def remove_attribute(random, notation, data, attribute, others):
    return replaced(data, attribute[0], b"")


@of_attributes
def repeat_attribute(random, notation, data, attribute, others):
    (_, end), name, value = attribute
    return data[:end] + notation.attribute(data[slice(*name)], data[slice(*value)], random) + data[end:]


@of_attributes
def rename_attribute(random, notation, data, attribute, others):
    source = random.choice(others)
    names = [source[slice(*one[1])] for one in notation.attributes(source)] or [b"name"]
    return replaced(data, attribute[1], random.choice([*names, b"if", b"unless", b"no_such_attribute", b"children", b"value"]))


@of_attributes
def add_attribute(random, notation, data, attribute, others):
    source = random.choice(others)
    names = [source[slice(*one[1])] for one in notation.attributes(source)] or [b"name"]
    end = attribute[0][1]
    return data[:end] + notation.attribute(random.choice(names), hostile_value(random), random) + data[end:]


@of_attributes
def swap_values(random, notation, data, attribute, others):
    source = random.choice(others)
    found = notation.attributes(source)
    return replaced(data, attribute[2], source[slice(*random.choice(found)[2])]) if found else data


def of_elements(change):
    """A change of one element; nothing where there is none."""
    def changed(random, notation, data, others):
        found = notation.elements(data)
        return change(random, notation, data, random.choice(found), others) if found else data

    changed.__name__ = change.__name__
    return changed


@of_elements
def remove_element(random, notation, data, element, others):
    return replaced(data, element, b"")


@of_elements
def repeat_element(random, notation, data, element, others):
    return replaced(data, element, data[slice(*element)] * random.choice((2, 2, 3, 50)))


@of_elements
def nest_element(random, notation, data, element, others):
    depth = random.choice((1, 2, 5, 25, 70, 500, 20000))
    names = [data[slice(*one)] for one in notation.names(data)] or [b"group"]
    name = random.choice([b"group", b"group", *names])
    return replaced(data, element, notation.nested(data[slice(*element)], depth, name))


@of_elements
def move_element(random, notation, data, element, others):
    part = data[slice(*element)]
    rest = replaced(data, element, b"")
    found = notation.elements(rest)
    place = random.choice(found)[random.randint(0, 1)] if found else len(rest)
    return rest[:place] + part + rest[place:]


@of_elements
def put_element(random, notation, data, element, others):
    source = random.choice(others)
    found = notation.elements(source)
    part = source[slice(*random.choice(found))] if found else b""
    place = random.choice((element[0], element[1], data.find(b">", *element) + 1 or element[1]))
    return data[:place] + part + data[place:]


def rename_element(random, notation, data, others):
    found = notation.names(data)
    source = random.choice(others)
    names = [source[slice(*one)] for one in notation.names(source)] or [b"node"]
    return replaced(data, random.choice(found), random.choice([*names, b"composable_node", b"no_such_tag"])) if found else data


# Changes of bytes mostly end at the parser of the notation; what is behind it needs more of the others.
CHANGES = (flip_bytes, remove_bytes, repeat_bytes, insert_bytes, repeat_attribute, *3 * (
    change_value, change_value, change_value, put_into_value, remove_attribute, rename_attribute, rename_attribute, add_attribute,
    swap_values, swap_values, remove_element, repeat_element, nest_element, move_element, put_element, rename_element))
