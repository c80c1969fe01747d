"""Domain randomisation: what is drawn anew for each episode, read from YAML."""
from __future__ import annotations

import importlib
import json
import math
import os

import numpy

from . import _doppel
from ._errors import InputError

# Each key, with the least value that it may have. They are drawn in this order, whatever the order of the file.
KEYS = {
    "start": -math.inf,      # rad, m: added to the start of each joint
    "mass": 0.01,            # factor of all masses and inertias of the robot
    "friction": 0.0,         # factor of the Coulomb friction, of each joint
    "damping": 0.0,          # factor of the viscous damping, of each joint
    "delay": 0.0,            # s, of the commands
    "position_noise": 0.0,   # rad, m: standard deviation of the observed q
    "velocity_noise": 0.0,   # rad/s, m/s: of the observed v
}
OVERLAY = "overlay"  # operations whose settings may be ranges


def is_text(source):
    """YAML has a colon behind each key, and a path of a file has neither that nor lines."""
    return isinstance(source, str) and ("\n" in source or ":" in source)


class Reader:
    """Reads the YAML, and names the place of what is wrong."""

    def __init__(self, source):
        self._file, self._places = None, {}
        self.content = self._read(source)
        if not isinstance(self.content, dict):
            self.refuse("the randomisation is not a mapping", f"write keys and ranges, as in 'mass: [0.9, 1.1]'; keys are {self.known()}")

    def known(self):
        return ", ".join([*KEYS, OVERLAY])

    def refuse(self, message, fix, key=None):
        line, column = self._places.get(key, (None, None))
        place = ":".join(str(part) for part in (self._file, line, column) if part is not None)
        text = f"{place + ': ' if place else ''}error: {message} [python.randomize]\n  fix: {fix}"
        raise InputError(text, [dict(severity="error", rule="python.randomize", message=message, file=self._file, line=line,
                                     column=column, fix=fix)])

    def _read(self, source):
        if isinstance(source, dict):
            return source
        text, self._file = source, "text"
        if not is_text(source):
            self._file = os.fspath(source)
            try:
                with open(source, encoding="utf-8") as file:
                    text = file.read()
            except OSError as error:
                self.refuse(f"it cannot be read: {error.strerror}", "pass a file, the YAML itself, or a dict")
        try:
            yaml = importlib.import_module("yaml")
        except ImportError:
            self.refuse("YAML cannot be read, because PyYAML is not installed", "install python3-yaml, or pass a dict")
        try:
            root = yaml.compose(text, Loader=yaml.SafeLoader)
            for key, _ in root.value if isinstance(root, yaml.MappingNode) else ():
                self._places[key.value] = (key.start_mark.line + 1, key.start_mark.column + 1)
            return yaml.safe_load(text)
        except yaml.MarkedYAMLError as error:
            if error.problem_mark:
                self._places["yaml"] = (error.problem_mark.line + 1, error.problem_mark.column + 1)
            self.refuse(f"this is not YAML: {error.problem}", "correct the line", "yaml")

    def range_of(self, value, key, least=-math.inf):
        """[low, high] of a number or of two of them."""
        ends = value if isinstance(value, (list, tuple)) else [value, value]
        try:
            low, high = (float(end) for end in ends)
        except (TypeError, ValueError):
            self.refuse(f"'{key}' is {value!r}; it must be a number or a range [low, high]", f"write '{key}: [0.9, 1.1]', say", key)
        if not (math.isfinite(low) and math.isfinite(high) and least <= low <= high):
            at_least = f" of {least:g} or more" if math.isfinite(least) else ""
            self.refuse(f"'{key}' is [{low:g}, {high:g}]; it must be finite numbers{at_least}, the lower one first",
                        "correct the range", key)
        return low, high


class Randomization:
    """What is drawn for each episode, from a file or text of YAML, or a dict."""

    def __init__(self, source):
        reader = Reader(source)
        for key in reader.content:
            if key not in KEYS and key != OVERLAY:
                near = _doppel.did_you_mean(str(key), [*KEYS, OVERLAY])
                reader.refuse(f"there is nothing '{key}' to be randomised{near}", f"the keys are {reader.known()}", key)
        self.ranges = {key: reader.range_of(reader.content[key], key, least)
                       for key, least in KEYS.items() if key in reader.content}
        self._operations = reader.content.get(OVERLAY) or []
        if not isinstance(self._operations, list) or not all(isinstance(one, dict) for one in self._operations):
            reader.refuse("'overlay' is not a list of operations", "write them as in an overlay: '- set_limit: elbow'", OVERLAY)
        for operation in self._operations:
            for name, value in operation.items():
                if is_range(value):
                    reader.range_of(value, f"{OVERLAY}: {name}")

    @property
    def changes_model(self):
        """True: each episode has a model of its own."""
        return bool(self._operations) or any(key in self.ranges for key in ("mass", "friction", "damping"))

    def draw(self, random, joints):
        """{key: value}: a number for the robot, or one for each of `joints` of its driven joints."""
        out = {}
        for key, (low, high) in self.ranges.items():
            each = key in ("start", "friction", "damping")
            out[key] = random.uniform(low, high, size=joints) if each else float(random.uniform(low, high))
        operations = [{name: float(random.uniform(*map(float, value))) if is_range(value) else value
                       for name, value in operation.items()} for operation in self._operations]
        if operations:
            out[OVERLAY] = json.dumps(operations)
        return out


def is_range(value):
    """True: two numbers. No operation has a setting of two numbers."""
    return isinstance(value, (list, tuple)) and len(value) == 2 and all(
        isinstance(one, (int, float)) and not isinstance(one, bool) for one in value)


def overlay_of(drawn, model, overlay):
    """The text of the overlay with the drawn operations behind those of `overlay`, a file or text; `model` has those already."""
    operations = []
    for key in ("friction", "damping"):
        for name, factor in zip(model.driven, drawn.get(key, ())):
            nominal = getattr(model.joints[name], key)
            if nominal > 0:
                operations.append({"set_dynamics": name, key: float(nominal * factor)})
    if "mass" in drawn:
        operations.append({"scale_masses": model.mass * drawn["mass"]})
    operations += json.loads(drawn.get(OVERLAY, "[]"))
    text = overlay or ""
    if text and not is_text(text):
        with open(text, encoding="utf-8") as file:
            text = file.read()
    return "\n".join([text, *(f"- {json.dumps(operation)}" for operation in operations)])
