"""For annotations."""

from typing import Any

SomeSubstitutionsType = Any
SomeSubstitutionsType_types_tuple = (str, list, tuple)
