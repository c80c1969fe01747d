"""Values for every field of a type, the same on every run, chosen so that errors of alignment, order and width are visible."""
import random

from golden.types import BASIC

WIDTH = {"byte": (0, 8), "char": (0, 8), "int8": (1, 8), "uint8": (0, 8), "int16": (1, 16), "uint16": (0, 16),
         "int32": (1, 32), "uint32": (0, 32), "int64": (1, 64), "uint64": (0, 64)}
TEXTS = ["a", "ab", "arm", "Gelenk ä", "joint_1", "it's \"it\"", "x: [1, 2]", "0123456789abcde", "line\nline", "tab\there"]
DOUBLES = [0.1, -1.0 / 3.0, 5e-324, 1.7976931348623157e308, -2.2250738585072014e-308, 123456.789, -0.5, 1e-9]
FLOATS = [0.5, -1.25, 1024.75, -0.0078125, 3.0, 16777215.0]  # their decimals are the same as float and as double
SPECIAL = [float("inf"), float("-inf"), float("nan"), -0.0, 0.0]
VARIANTS = ("full", "ragged")


class Values:
    """'full': nothing is zero or empty. 'ragged': empty and long lists and strings side by side, and values that are not
    finite."""

    def __init__(self, types, name, variant):
        self.types = types
        self.ragged = variant == "ragged"
        self.random = random.Random(f"{name} {variant}")

    def message(self, name):
        return {field.name: self.field(field) for field in self.types.by_name[name].fields}

    def field(self, field):
        if field.shape == "single":
            return self.element(field)
        size = field.size
        if field.shape == "sequence":
            size = self.random.randint(0 if self.ragged else 1, min(field.size or 3, 3))
        return [self.element(field) for _ in range(size)]

    def element(self, field):
        if field.type not in BASIC:
            return self.message(field.type)
        if field.type == "bool":
            return not self.ragged or self.random.random() < 0.5
        if field.type in ("string", "wstring"):
            texts = [text for text in TEXTS if not field.text_bound or len(text.encode()) <= field.text_bound]
            return "" if self.ragged and self.random.random() < 0.4 else self.random.choice(texts)
        if field.type in ("float32", "float64"):
            plain = FLOATS if field.type == "float32" else DOUBLES
            return self.random.choice(plain + SPECIAL if self.ragged else plain)
        signed, bits = WIDTH[field.type]
        least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (1, (1 << bits) - 1)
        some = self.random.randint(1, most)
        return self.random.choice([least, most, some, some, some, some])


def to_json(value):
    """As JSON (RFC 8259), with null for values that are not finite."""
    import json
    import math

    def finite(value):
        if isinstance(value, dict):
            return {key: finite(each) for key, each in value.items()}
        if isinstance(value, list):
            return [finite(each) for each in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value
    return json.dumps(finite(value), ensure_ascii=False, separators=(",", ":"))
