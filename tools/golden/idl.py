"""Types as the IDL that rosidl hands to a DDS vendor's generator: modules <package>::msg::dds_, names with a trailing '_'."""
from golden.types import BASIC

BASIC_IDL = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}
HEADING = "// Made by tools/make_golden_vectors; not to be edited.\n"


def scoped(name):
    """sensor_msgs/msg/JointState -> sensor_msgs::msg::dds_::JointState_"""
    package, kind, leaf = name.split("/")
    return f"{package}::{kind}::dds_::{leaf}_"


def member(field):
    base = BASIC_IDL.get(field.type, field.type) if field.type in BASIC else scoped(field.type)
    if field.text_bound:
        base += f"<{field.text_bound}>"
    if field.shape == "sequence":
        base = f"sequence<{base}, {field.size}>" if field.size else f"sequence<{base}>"
    return f"{base} {field.name}_{f'[{field.size}]' if field.shape == 'array' else ''};"


def struct(type):
    package, kind, leaf = type.name.split("/")
    members = [member(field) for field in type.fields] or ["uint8 structure_needs_at_least_one_member_;"]
    return (f"module {package} {{ module {kind} {{ module dds_ {{\nstruct {leaf}_ {{\n"
            + "".join(f"  {line}\n" for line in members) + "};\n}; }; };\n")


def package_idl(types, package):
    own = types.of_package(package)
    used = {field.type.split("/")[0] for type in own for field in type.fields if field.type not in BASIC}
    guard = f"{package.upper()}_IDL"
    includes = "".join(f'#include "{name}.idl"\n' for name in sorted(used - {package}))
    body = "\n".join(struct(type) for type in own)
    return f"{HEADING}#ifndef {guard}\n#define {guard}\n{includes}\n{body}\n#endif\n"
