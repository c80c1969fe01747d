"""Spaces and base classes of environments: those of Gymnasium, or, where it is not installed, ones with the same numbers for the
same seed."""
from __future__ import annotations

import enum
import importlib
from typing import Any

import numpy

from ._errors import refuse

gymnasium: Any = None
try:
    gymnasium = importlib.import_module("gymnasium")
except ImportError:
    pass


def seeded_generator(seed=None):
    """A generator and its seed, as gymnasium.utils.seeding.np_random; None: a random one."""
    if seed is not None and not (isinstance(seed, int) and seed >= 0):
        refuse("python.seed", f"the seed is {seed!r}; it must be an int of 0 or more, or None")
    sequence = numpy.random.SeedSequence(seed)
    return numpy.random.Generator(numpy.random.PCG64(sequence)), sequence.entropy


class Seeded:
    """Something with a generator of random numbers, made when it is first used."""

    _generator: tuple[Any, Any] | None = None

    def _seeded(self):
        if self._generator is None:
            self._generator = seeded_generator()
        return self._generator

    @property
    def np_random(self) -> numpy.random.Generator:
        """The generator."""
        return self._seeded()[0]

    @property
    def np_random_seed(self) -> int:
        """The seed of the generator."""
        return self._seeded()[1]


class PlainBox(Seeded):
    """Arrays between two bounds, as gymnasium.spaces.Box of floating numbers."""

    def __init__(self, low, high, shape=None, dtype=numpy.float32, seed=None):
        self.dtype = numpy.dtype(dtype)
        self.shape = numpy.broadcast(low, high).shape if shape is None else tuple(shape)
        self.low = numpy.broadcast_to(low, self.shape).astype(self.dtype)
        self.high = numpy.broadcast_to(high, self.shape).astype(self.dtype)
        if not (self.low <= self.high).all():
            refuse("python.range", "a lower bound of the space is above the upper one, or not a number")
        if seed is not None:
            self.seed(seed)

    def seed(self, seed=None):
        """Seeds sample(); returns the seed."""
        self._generator = seeded_generator(seed)
        return self._generator[1]

    def sample(self):
        """A random element: even between bounds, exponential from a single one on, normal without one."""
        random, out = self.np_random, numpy.empty(self.shape)
        below, above = numpy.isfinite(self.low), numpy.isfinite(self.high)
        free, upwards, downwards, both = ~below & ~above, below & ~above, ~below & above, below & above
        out[free] = random.normal(size=free.sum())
        out[upwards] = self.low[upwards] + random.exponential(size=upwards.sum())
        out[downwards] = self.high[downwards] - random.exponential(size=downwards.sum())
        out[both] = random.uniform(self.low[both], self.high[both])
        return out.astype(self.dtype)

    def contains(self, x):
        """True: an array of this shape and a number type that fits, within the bounds."""
        return (isinstance(x, numpy.ndarray) and numpy.can_cast(x.dtype, self.dtype) and x.shape == self.shape
                and bool(((x >= self.low) & (x <= self.high)).all()))

    __contains__ = contains

    def __eq__(self, other):
        return (isinstance(other, PlainBox) and (self.shape, self.dtype) == (other.shape, other.dtype)
                and numpy.allclose(self.low, other.low) and numpy.allclose(self.high, other.high))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self):
        return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"


class PlainEnv(Seeded):
    """The part of gymnasium.Env that is not the environment's own."""

    metadata: dict[str, Any] = {"render_modes": []}
    render_mode: str | None = None
    spec = None

    def reset(self, *, seed=None, options=None):
        """Seeds np_random, unless the seed is None."""
        if seed is not None:
            self._generator = seeded_generator(seed)

    unwrapped = property(lambda self: self, doc="Itself.")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class PlainVectorEnv:
    """The part of gymnasium.vector.VectorEnv that is not the environment's own."""

    spec, closed = None, False
    unwrapped = property(lambda self: self, doc="Itself.")

    def close(self, **_):
        """Ends it; a second call does nothing."""
        if not self.closed:
            self.close_extras()
            self.closed = True

    def _add_info(self, infos, info, number):
        for key, value in info.items():
            if isinstance(value, dict) and key != "final_obs":
                column = self._add_info(infos.get(key, {}), value, number)
            else:
                column = infos[key] if key in infos else self._empty_column(key, value)
                column[number] = value
            infos[key] = column
            infos.setdefault(f"_{key}", numpy.zeros(self.num_envs, dtype=bool))[number] = True
        return infos

    def _empty_column(self, key, value):
        if key != "final_obs" and isinstance(value, numpy.ndarray):
            return numpy.zeros((self.num_envs, *value.shape), dtype=value.dtype)
        if key != "final_obs" and isinstance(value, (bool, int, float, numpy.number)):
            return numpy.zeros(self.num_envs, dtype=type(value))
        return numpy.full(self.num_envs, None, dtype=object)


class PlainAutoresetMode(enum.Enum):
    """When a part of a vector environment begins again after its end."""

    NEXT_STEP = "NextStep"  # the next step resets it, and ignores its action
    SAME_STEP = "SameStep"  # the step that ends it also resets it; infos has final_obs and final_info
    DISABLED = "Disabled"   # reset(options={"reset_mask": ...}) resets it


Box: Any = PlainBox
Env: Any = PlainEnv
VectorEnv: Any = PlainVectorEnv
AutoresetMode: Any = PlainAutoresetMode
if gymnasium is not None:
    Box, Env, VectorEnv = gymnasium.spaces.Box, gymnasium.Env, gymnasium.vector.VectorEnv
    AutoresetMode = getattr(gymnasium.vector, "AutoresetMode", PlainAutoresetMode)  # since 1.1


def batch(space, count):
    """The space of `count` elements of a space."""
    return Box(numpy.repeat(space.low[None], count, axis=0), numpy.repeat(space.high[None], count, axis=0), dtype=space.dtype)
