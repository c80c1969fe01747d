"""What a public header of doppel is, for the checks in this folder: a header that lies directly in the folder of its module, or
in src/doppel itself. Headers in folders below a module (detail/, test/, the folder of an engine) are private to it;
those that public headers include for their templates are installed with them. cmake/install.cmake follows the same rule.
"""
import re

TEMPLATES = re.compile(r'(?m)^#include "(doppel/\w+/\w+/\w+/[\w/]+\.h)"')


def is_public(header):
    """header: its path below src/doppel or an installation's doppel folder, as a pathlib.PurePath."""
    return header.suffix == ".h" and len(header.parts) in (1, 3)


def public_headers(include_folder):
    """Of src, or of an installation's include folder; sorted."""
    folder = include_folder / "doppel"
    return sorted(path for path in folder.rglob("*.h") if is_public(path.relative_to(folder)))


def installed_headers(include_folder):
    """The public headers, then those that they include for their templates."""
    headers = public_headers(include_folder)
    for path in headers:  # grows
        for included in TEMPLATES.findall(path.read_text()):
            if include_folder / included not in headers:
                headers.append(include_folder / included)
    return headers
