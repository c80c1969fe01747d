"""Elements that have names and an order."""
from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Generic, TypeVar, overload

from . import _doppel
from ._errors import refuse

T = TypeVar("T")


class Named(Mapping[str, T], Generic[T]):
    """A mapping of names in a fixed order, which is also read by number: joints["Revolute 2"], joints[2], joints[-1], joints[:3].
    As of any mapping, iteration gives the names, values() the elements."""

    def __init__(self, kind: str, names: Iterable[str], values: Iterable[T]):
        self._kind = kind
        self._values = list(values)
        self._numbers = {name: number for number, name in enumerate(names)}

    @property
    def names(self) -> list[str]:
        """The names, in order."""
        return list(self._numbers)

    def index(self, name: str) -> int:
        """The number of a name; raises InputError with the nearest name if there is none."""
        if name not in self._numbers:
            near = _doppel.did_you_mean(str(name), self.names)
            refuse("python.unknown_name", f"there is no {self._kind} '{name}'{near}")
        return self._numbers[name]

    @overload
    def __getitem__(self, key: int | str) -> T: ...

    @overload
    def __getitem__(self, key: slice) -> list[T]: ...

    def __getitem__(self, key: int | str | slice) -> T | list[T]:
        return self._values[self.index(key) if isinstance(key, str) else key]

    def get(self, key: str, default: Any = None) -> Any:
        """The element of this name; without one, the default."""
        return self[key] if key in self else default

    def __contains__(self, key: object) -> bool:
        return key in self._numbers

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._values)

    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __repr__(self):
        return f"<{len(self)} {self._kind}s: {', '.join(self.names)}>"


def matches(name: str, known: Sequence[str]) -> list[str]:
    """The known names that `name` means: itself, else those with it as words between underlines or slashes, else as a part."""
    if name in known:
        return [name]
    words = [one for one in known if f"_{name}_" in f"_{one.replace('/', '_')}_"]
    return words or [one for one in known if name in one]
