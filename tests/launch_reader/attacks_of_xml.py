"""Whole parts of launch files in XML that are known to harm readers, of ROS 2 and ROS 1."""
import re

from hostile import PLAIN_VALUES, encoded

# Names of files in the folder of world.py that are no launch files, or not there.
NO_LAUNCH_FILES = (
    b"pipe.launch.yaml", b"pipe.launch.xml", b"pipe.launch.py", b"device.launch.xml", b"folder.launch.xml", b"none.launch.xml",
    b"nothing.launch.yaml", b"nothing.launch.py", b"../launch", b"", b"a" * 300, b"\xc3\xa9" * 3000)


def after_root(seed, part):
    """Puts a part behind the tag of the root."""
    root = seed.find(b"<launch>")
    return seed[:root + 8] + part + seed[root + 8:] if root >= 0 else b"<launch>" + part + b"</launch>"


def with_type(seed, declaration, part):
    """Puts a document type before the root, and a part into it."""
    seed = after_root(seed, part)
    root = seed.find(b"<launch>")
    return seed[:root] + b"<!DOCTYPE launch " + declaration + b">\n" + seed[root:]


def use_of_entity(random, name):
    return random.choice((
        b"&e;", b"<rosparam>&e;</rosparam>", b"<rosparam param='a'>&e;&e;</rosparam>", b'<arg name="e" default="&e;"/>',
        b'<log message="&e;"/>', b'<param name="a" value="&e;"/>', b'<node pkg="p" exec="e"><param name="a" value="&e;"/></node>',
    )).replace(b"&e;", b"&%s;" % name)


def entities_that_multiply(random, seed, name):
    levels, width = random.choice(((9, 10), (30, 2), (3, 400), (2, 3000)))
    declared = b'<!ENTITY e0 "lol">'
    declared += b"".join(b'<!ENTITY e%d "%s">' % (i, b"&e%d;" % (i - 1) * width) for i in range(1, levels + 1))
    return with_type(seed, b"[%s]" % declared, use_of_entity(random, b"e%d" % levels))


def long_entity_that_repeats(random, seed, name):
    content = random.choice((b"a", b"a\n", b"<group/>")) * random.choice((1000, 30_000))
    return with_type(seed, b'[<!ENTITY e "%s">]' % content, use_of_entity(random, b"e") * 40)


def entity_of_elements(random, seed, name):
    content = random.choice((b"<node pkg='p' exec='e'/>", b"<group>&e;</group>", b"<group>", b"</group>", b"$(var ",
                             b"<include file='$(filename)'/>"))
    return with_type(seed, b'[<!ENTITY e "%s">]' % content, b"&e;" * random.choice((1, 100)))


def entity_of_file(random, seed, name):
    file = random.choice((b"file:///etc/passwd", b"/etc/passwd", b"canary.txt", b"canary.dtd", b"pipe.launch.xml", b"/dev/zero",
                          b"http://localhost/"))
    declared = random.choice((
        b'[<!ENTITY e SYSTEM "%s">]', b'[<!ENTITY e PUBLIC "a" "%s">]', b'SYSTEM "%s"', b'PUBLIC "a" "%s"',
        b'[<!ENTITY %% p SYSTEM "%s"> %%p;]', b'[<!NOTATION n SYSTEM "a"><!ENTITY e SYSTEM "%s" NDATA n>]',
        b'[<!ENTITY %% p SYSTEM "%s"><!ENTITY %% q "<!ENTITY e SYSTEM \'%%p;\'>"> %%q;]')) % file
    return with_type(seed, declared, use_of_entity(random, b"e"))


def attribute_declarations(random, seed, name):
    return with_type(seed, random.choice((
        b'[<!ATTLIST node pkg CDATA "p" a CDATA #IMPLIED>]', b'[<!ATTLIST group if CDATA "maybe">]', b"[<!ATTLIST launch a ID #REQUIRED>]",
        b"[<!ELEMENT launch (node*)>]", b"[<!ELEMENT launch " + b"(" * 5000 + b"a" + b")" * 5000 + b">]")), b"")


def file_by_instruction(random, seed, name):
    return after_root(seed, random.choice((
        b'<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="canary.txt" parse="text"/>', b'<rosparam file="canary.txt"/>',
        b'<?xml-stylesheet href="canary.txt"?>', b"<?php include 'canary.txt' ?>")))


def unknown_encoding(random, seed, name):
    encoding = random.choice((
        b"utf-16", b"utf-32", b"utf-7", b"latin-1", b"ascii", b"cp1252", b"shift_jis", b"nothing", b"", b"idna", b"rot13", b"hex",
        b"unicode_escape", b"undefined", b"x" * 5000))
    rest = seed[seed.find(b"<launch>"):]
    if random.random() < 0.3:
        rest = rest.decode(errors="replace").encode(random.choice(("utf-16", "utf-32", "utf-16-le", "utf-7")))
    return b'<?xml version="1.0" encoding="' + encoding + b'"?>\n' + rest


def xml_that_is_deep(random, seed, name):
    depth = random.choice((50, 61, 300, 5000, 60_000))
    tag = random.choice((b"group", b"param name='a'", b"timer period='1'", b"node pkg='p' exec='e'", b"node pkg='p' type='t'", b"a",
                         b"include file='$(dirname)/inner.launch.xml'"))
    inner = random.choice((b"", b"b", b"<param name='a'>" * 300 + b"</param>" * 300))
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
    kind = random.choice((b'<set_env name="a%d" value="b"/>', b'<set_parameter name="a%d" value="b"/>',
                          b'<set_remap from="a%d" to="b"/>', b'<env name="a%d" value="b"/>'))
    node = b'<node pkg="p" type="t" name="n"/>' if name.endswith(".launch") else b'<node pkg="p" exec="e"/>'
    return after_root(seed, b"".join(kind % i for i in range(count)) + node * count)


def includes_that_multiply(random, seed, name):
    file = random.choice((b"$(filename)", b"$(dirname)/multiplying.launch.xml", b"$(dirname)/inner.launch.xml",
                          b"$(dirname)/every.launch.xml"))
    return after_root(seed, b'<include file="%s"/>' % file * random.choice((1, 2, 30)))


def includes_of_no_launch_file(random, seed, name):
    element = random.choice((
        b'<include file="$(dirname)/%s"/>', b'<include file="$(dirname)/%s"/>', b'<param name="a" textfile="$(dirname)/%s"/>',
        b'<rosparam command="load" file="$(dirname)/%s"/>',
        b'<node pkg="p" exec="e"><param from="$(dirname)/%s" allow_substs="true"/></node>'))
    return after_root(seed, element % random.choice(NO_LAUNCH_FILES) * random.choice((1, 1, 100)))


def hostile_parameters(random, seed, name):
    """Values of many parameters, which are read as YAML: none of them has a substitution that could be refused."""
    values = [one.replace(b"&", b"&amp;").replace(b"<", b"&lt;").replace(b'"', b"&quot;")
              for one in map(encoded, random.sample(PLAIN_VALUES, 25)) if not re.search(rb"[\x00-\x08\x0e-\x1f]|\xef\xbf\xbf", one)]
    kind = random.choice((b"", b' type="str"', b' type="int"', b' type="double"', b' type="bool"', b' type="yaml"', b' value-sep=";"'))
    parameters = b"".join(b'<param name="a%d" value="%s"%s/>' % (*one, kind) for one in enumerate(values))
    if not name.endswith(".launch"):
        return after_root(seed, b'<node pkg="p" exec="e">%s</node>' % parameters)
    return after_root(seed, parameters + b"".join(b"<rosparam param='b'>%s</rosparam>" % one for one in values))


ATTACKS = (
    entities_that_multiply, entity_of_elements, entity_of_file, entity_of_file, attribute_declarations, file_by_instruction,
    unknown_encoding, xml_that_is_deep, many_attributes, includes_of_no_launch_file, hostile_parameters, hostile_parameters)
COSTLY = (long_entity_that_repeats, texts_that_double, records_that_multiply, includes_that_multiply)
