"""rollout: many runs of one robot at once."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING

from . import _doppel
from ._errors import numbers, refuse, whole

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

    from ._model import Model
    from ._twin import Twin


def rollout(model: Model | Twin | str, state0: ArrayLike | None, commands: ArrayLike, threads: int = 0, *,
            steps_per_row: int = 1, mode: str = "position", world: str | os.PathLike[str] | None = None,
            engine: str = "mujoco", step: float | None = None) -> NDArray[numpy.float64]:
    """Runs of the physics without controllers, each from its own state with its own commands.

    model:    a Model, or a Twin whose world, engine and step are used
    state0:   [runs, nq + nv] or, for all runs, [nq + nv]: q then v; None: the start
    commands: [runs, rows, driven] or, for one run, [rows, driven]: targets of the driven joints in rad, m; NaN: no drive
    threads:  0: one for each processor
    steps_per_row: each row of commands acts for this many steps
    mode:     of the commands: "position", "velocity" (rad/s, m/s) or "effort" (N m, N)

    Returns the states [runs, rows, nq + nv] after each row, NaN from where a run diverges on. They are bit-identical at any
    number of threads, because a run depends on its own inputs alone.
    """
    import numpy

    from ._twin import Twin
    twin = model if isinstance(model, Twin) else Twin(model, world=world, engine=engine, step=step, controllers=False)
    start = numpy.concatenate([twin.q, twin.v]) if state0 is None else numbers("state0", state0)
    commands = numbers("commands", commands)
    single = commands.ndim == 2
    commands = commands[None] if single else commands
    driven, size = len(twin.command), len(twin.q) + len(twin.v)
    if commands.ndim != 3 or commands.shape[2] != driven:
        refuse("python.shape", f"commands has the shape {list(commands.shape)}, and [runs, rows, {driven}] is needed",
               "pass one column for each driven joint (model.driven)")
    start = numpy.broadcast_to(start, (len(commands), size)) if start.ndim == 1 and len(start) == size else start
    if start.shape != (len(commands), size):
        refuse("python.shape", f"state0 has the shape {list(start.shape)}, and [{len(commands)}, {size}] is needed",
               "pass q and v of each run, one behind the other")
    states = _doppel.rollout(twin._t, start, commands, whole("threads", threads) or os.cpu_count() or 1, mode,
                             whole("steps_per_row", steps_per_row, 1))
    return states[0] if single else states
