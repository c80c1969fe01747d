"""The exceptions of doppel."""
from __future__ import annotations

import operator
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class InputError(ValueError):
    """Something that was passed cannot be used.

    The text names the place (file:line:column), what is wrong, and the fix. `diagnostics` has the same as a list of dicts
    with the keys severity, rule, message, file, line, column and fix; file, line and column are None where there is no file.
    """

    def __init__(self, text: str, diagnostics: Iterable[dict[str, Any]] = ()):
        super().__init__(text)
        self.diagnostics: list[dict[str, Any]] = list(diagnostics)


class IkError(ValueError):
    """A pose that cannot be reached. `nearest` is the configuration q [nq] that comes nearest to it within the limits."""

    def __init__(self, text: str, nearest: NDArray[numpy.float64]):
        super().__init__(text)
        self.nearest = nearest


class ServiceError(RuntimeError):
    """A service, an action or a controller has refused a request, or has not answered in time."""


def refuse(rule: str, message: str, fix: str = "") -> NoReturn:
    """Raises an InputError without a place in a file."""
    text = f"error: {message} [{rule}]" + (f"\n  fix: {fix}" if fix else "")
    raise InputError(text, [dict(severity="error", rule=rule, message=message, file=None, line=None, column=None, fix=fix)])


MAX_SECONDS = 1e9  # 31 years; times are counted in ns, of which 64 bits have 292 years


def whole(name: str, value: Any, least: int = 0, most: int = 2**63 - 1) -> int:
    """The value, which must be a whole number of this range."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if not least <= number <= most:
        refuse("python.range", f"{name} is {value!r}; it must be a whole number " + (
            f"from {least} to {most}" if most < 2**63 - 1 else f"of {least} or more"))
    return number


def seconds(name: str, value: Any) -> float:
    """The value, which must be a time in s, zero or more."""
    number = single(name, value)
    if not 0 <= number <= MAX_SECONDS:
        refuse("python.range", f"{name} is {value!r}; it must be a time in s, from 0 to {MAX_SECONDS:g}")
    return number


def single(name: str, value: Any) -> float:
    """The value, which must be a number."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        refuse("python.range", f"{name} is {value!r}; it must be a number")


def numbers(name: str, value: Any) -> NDArray[numpy.float64]:
    """The value, which must be numbers; their shape is checked where it is known."""
    import numpy
    try:
        return numpy.asarray(value, dtype=float)
    except (TypeError, ValueError):
        refuse("python.numbers", f"{name} is {value!r:.60}; it must be an array of numbers")


def shaped(name: str, value: Any, *shapes: tuple[int, ...]) -> NDArray[numpy.float64]:
    """The value, which must be numbers of one of these shapes."""
    array = numbers(name, value)
    if array.shape not in shapes:
        known = " or ".join(str(list(shape)) for shape in shapes)
        refuse("python.shape", f"{name} has the shape {list(array.shape)}, and {known} is needed")
    return array
