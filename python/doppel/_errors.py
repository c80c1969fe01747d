"""The exceptions of doppel."""
from __future__ import annotations

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
