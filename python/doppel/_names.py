"""Sequences whose elements have names."""
from collections.abc import Sequence

from . import _doppel
from ._errors import refuse


class Named(Sequence):
    """A sequence that is read by number and by name: joints[2], joints["Revolute 2"]."""

    def __init__(self, kind, names, values):
        self._kind = kind
        self._values = list(values)
        self._numbers = {name: number for number, name in enumerate(names)}

    @property
    def names(self):
        """The names, in order."""
        return list(self._numbers)

    def index(self, name):
        """The number of a name; raises InputError with the nearest name if there is none."""
        if name not in self._numbers:
            near = _doppel.did_you_mean(str(name), self.names)
            refuse("python.unknown_name", f"there is no {self._kind} '{name}'{near}")
        return self._numbers[name]

    def __getitem__(self, key):
        return self._values[self.index(key) if isinstance(key, str) else key]

    def __contains__(self, key):
        return key in self._numbers if isinstance(key, str) else key in self._values

    def __len__(self):
        return len(self._values)

    def __repr__(self):
        return f"<{len(self)} {self._kind}s: {', '.join(self.names)}>"


def matches(name, known):
    """The known names that `name` means: itself, else those with it as words between underlines or slashes, else as a part."""
    if name in known:
        return [name]
    words = [one for one in known if f"_{name}_" in f"_{one.replace('/', '_')}_"]
    return words or [one for one in known if name in one]
