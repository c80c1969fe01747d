"""Texts of launch files as words and numbers."""

import math
import shlex

from .record import LaunchError


def split_words(text, place=("", 0)):
    """The words of a command, as a shell splits them."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise LaunchError(f"'{text}' cannot be split into words: {str(error).lower()}", place) from None


def finite_number(value, place=("", 0)):
    """A text or a number as a time, which JSON has only if it is finite."""
    try:
        number = float(value)
    except (OverflowError, TypeError, ValueError) as error:
        raise LaunchError(f"'{value}' is not a number", place) from None
    if not math.isfinite(number):
        raise LaunchError(f"'{value}' is not a finite number", place)
    return number
