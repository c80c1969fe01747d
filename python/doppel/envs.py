"""Environments for reinforcement learning, with the interface of Gymnasium; they also run where it is not installed.

    import gymnasium, doppel.envs
    env = gymnasium.make("doppel/Reach-v0", model="omarm_one")          # or doppel.envs.ReachEnv("omarm_one")
    envs = gymnasium.make_vec("doppel/Reach-v0", num_envs=16)           # or doppel.envs.ReachVectorEnv(16)
"""
from __future__ import annotations

import collections
import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy

from ._errors import InputError, refuse
from ._model import Model
from ._randomize import Randomization, overlay_of
from ._spaces import AutoresetMode, Box, Env, VectorEnv, batch, gymnasium
from ._twin import Twin

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["ReachEnv", "ReachVectorEnv"]

TOOL_WORDS = ("tool0", "tool", "tcp", "ee", "eef", "end_effector", "gripper_frame", "grasp")
HOLD_TIME, MAX_SAG = 0.05, 0.005  # s and m: how long and how well the arm must hold a pose at a target
MAX_DRAWS = 1000  # of a target


def joints_to(model, link):
    """The scalar joints from the root to a link that a drive moves."""
    out, driven = [], set(model.driven)
    while model.links[link].joint is not None:
        joint = model.joints[model.links[link].joint]
        if joint.name in driven:
            out.insert(0, joint)
        link = joint.parent
    return out


def tool_link(model, name):
    """The link of this name; None: one with the name of a tool, else the last one behind the most driven joints."""
    if name is not None:
        return model.links[model.links.index(name)].name
    for word in TOOL_WORDS:
        for link in model.links.names:
            if f"_{word}_" in f"_{link}_" and joints_to(model, link):
                return link
    return max(reversed(model.links.names), key=lambda link: len(joints_to(model, link)))


def command_range(joint):
    """The positions that the actions -1 and 1 stand for; a joint without limits has one turn."""
    if math.isfinite(joint.lower) and math.isfinite(joint.upper):
        return joint.lower, joint.upper
    if joint.type not in ("revolute", "continuous"):
        refuse("python.no_limit", f"the joint '{joint.name}' has no limits, so that actions have no range",
               "add its limits to the description, or an overlay with set_limit")
    return -math.pi, math.pi


class ReachEnv(Env):
    """The tool of an arm reaches a random target.

    Action [arm]: position commands, -1 at the lower limit of a joint and 1 at the upper one. Observation [2 arm + 6]: q and v of
    the arm's joints, position of the tool, target; rad, m and their rates, in the world. Reward: minus the distance in m.
    Terminated within `tolerance`, truncated after `max_steps`. The info has distance and is_success, that of a reset also q_target
    [arm], one of the poses at the target, and `randomized`, what was drawn.

    Equal seeds and actions give equal runs, bit for bit.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(self, model: Model | str | os.PathLike[str] = "omarm_one", *, tool: str | None = None,
                 args: Mapping[str, object] | None = None, overlay: str | os.PathLike[str] | None = None,
                 world: str | os.PathLike[str] | None = None, engine: str = "mujoco", step: float | None = None,
                 period: float = 0.02, max_steps: int | None = None, tolerance: float = 0.01,
                 randomize: Mapping[str, Any] | str | os.PathLike[str] | None = None, camera: str | None = None,
                 render_mode: str | None = None):
        """model, args, overlay: as of Model.load, or a Model
        tool:      the link that reaches; None: found by its name, else the last of the longest chain
        world, engine, step: as of Twin
        period:    s, for which an action acts
        max_steps: actions of an episode; None: those of 4 s, or more if a joint is too slow to cross its range in 2 s
        tolerance: m
        randomize: what is drawn for each episode (docs/python.md): a file or text of YAML, or a dict
        camera:    a part of the name of the camera of render(); None: the first
        render_mode: None or "rgb_array"

        Raises InputError.
        """
        if period <= 0 or tolerance <= 0 or (max_steps is not None and max_steps < 1):
            refuse("python.range", f"period is {period}, max_steps {max_steps} and tolerance {tolerance}; they must be above zero")
        self._source = (model, args, overlay)
        self._twin_options = dict(world=world, engine=engine, step=step, controllers=False)
        self._randomization = None if randomize is None else Randomization(
            dict(randomize) if isinstance(randomize, Mapping) else randomize)
        if isinstance(model, Model) and self._randomization and self._randomization.changes_model:
            refuse("python.no_source", "a Model cannot be randomised", "pass its file or name, with args and overlay")
        self.period, self.tolerance = period, tolerance
        self.model = model if isinstance(model, Model) else Model.load(model, args, overlay)
        self.tool = tool_link(self.model, tool)
        self._joints = joints_to(self.model, self.tool)
        if not self._joints:
            refuse("python.no_arm", f"no joint moves the link '{self.tool}'", "pass tool=, a link of the arm")
        self._low, self._high = numpy.array([command_range(joint) for joint in self._joints]).T
        slowest = max((high - low) / joint.velocity if joint.velocity > 0 else 0.0
                      for joint, low, high in zip(self._joints, self._low, self._high))
        self.max_steps = max_steps if max_steps is not None else math.ceil((2.0 + max(2.0, slowest)) / period)
        self._running = False
        self._drawn: dict[str, Any] = {}
        self._take_twin(self.model)
        self._steps = max(1, round(period / self.twin.step_size))  # of the physics in a period
        self.action_space = Box(-1.0, 1.0, shape=(len(self._joints),), dtype=numpy.float32)
        self.observation_space = Box(-numpy.inf, numpy.inf, shape=(2 * len(self._joints) + 6,), dtype=numpy.float64)
        self._camera_name, self.render_mode = self._check_rendering(camera, render_mode), render_mode

    def _check_rendering(self, camera, render_mode):
        known = self.twin.topics()
        names = [one["name"] for one in self.twin.sensors()
                 if any(known.get(topic) == "sensor_msgs/msg/Image" for topic in one["topics"])]
        self.metadata = {"render_modes": ["rgb_array"] if names else [], "render_fps": round(1 / self.period)}
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            refuse("python.render_mode", f"render_mode is '{render_mode}'; " + (
                "it must be None or 'rgb_array'" if names else "the robot has no camera, so that it must be None"),
                "leave it out, or take a robot with a camera")
        return camera if camera is not None or not names else names[0]

    def _take_twin(self, model):
        """A twin whose start every episode restores, because a reset alone may keep the solver's last guess."""
        self.twin = Twin(model, **self._twin_options)
        self._start = self.twin.save()
        joints = [self.twin.joint(joint.name) for joint in self._joints]  # its base may be floating, that of the model is fixed
        self._q, self._v = (numpy.array([getattr(joint, index) for joint in joints]) for index in ("_q", "_v"))
        driven = self.twin.robots[0].driven
        self._columns = numpy.array([driven.index(joint.name) for joint in self._joints])
        self._rest = self.twin.q.copy()
        self._held = self._rest[[self.twin.joint(name)._q for name in driven]]
        self._camera = None

    def _tool_position(self):
        return self.twin.robots[0].link_poses()[self.tool][:3, 3].copy()

    def _go_to(self, arm):
        """Restores the start, with the arm at rest in a pose that its commands hold."""
        self.twin.restore(self._start)
        q = self._rest.copy()
        q[self._q] = arm
        for joint in self.model.joints.values():
            if joint.mimics is not None:
                leader = q[self.twin.joint(joint.mimics)._q]
                q[self.twin.joint(joint.name)._q] = joint.multiplier * leader + joint.offset
        self.twin.set_state(q)
        self.twin.command[:] = self._held
        self.twin.command[self._columns] = arm

    def _draw_target(self, start):
        """A pose within the limits that the arm can hold against gravity and contacts, and the tool's position in it."""
        for _ in range(MAX_DRAWS):
            arm = self.np_random.uniform(self._low, self._high)
            self._go_to(arm)
            target = self._tool_position()
            if math.dist(target, start) <= self.tolerance:
                continue
            try:
                self.twin.run_for(HOLD_TIME)
            except InputError:  # the contact was so deep that the physics diverged
                continue
            if math.dist(target, self._tool_position()) < MAX_SAG:
                return target, arm
        refuse("python.no_target", f"none of {MAX_DRAWS} random poses is one that the arm can hold with '{self.tool}' away from its start",
               "pass tool=, a link of the arm, or check masses, limits of effort and collisions (doppel check)")

    def _randomize(self):
        self._drawn = self._randomization.draw(self.np_random, len(self.model.driven)) if self._randomization else {}
        if self._randomization and self._randomization.changes_model:
            source, args, overlay = self._source
            self.twin.close()
            self._take_twin(Model.load(source, args, overlay_of(self._drawn, self.model, overlay)))

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[NDArray[numpy.float64], dict[str, Any]]:
        """Begins an episode; returns observation and info. options: {"target": [3] in m}: instead of a random one."""
        super().reset(seed=seed)
        unknown = set(options or {}) - {"target"}
        if unknown:
            refuse("python.option", f"there is no option '{sorted(unknown)[0]}'", "the options are target")
        self._randomize()
        start = self._rest[self._q] + self._drawn.get("start", numpy.zeros(len(self._held)))[self._columns]
        start = numpy.clip(start, self._low, self._high)
        self._go_to(start)
        info: dict[str, Any] = {}
        if options and "target" in options:
            self.target = numpy.array(options["target"], dtype=float)
            if self.target.shape != (3,) or not numpy.isfinite(self.target).all():
                refuse("python.shape", "the option target must be three finite numbers, in m")
        else:
            self.target, info["q_target"] = self._draw_target(self._tool_position())
            self._go_to(start)
        self._now, self._taken, self._running = 0, 0, True
        self._delay = round(self._drawn.get("delay", 0.0) / self.twin.step_size)
        self._pending: collections.deque[tuple[int, Any]] = collections.deque()
        self._end_pictures()
        if self._drawn:
            info["randomized"] = dict(self._drawn)
        observation, distance = self._last = self._observe()
        return observation.copy(), {"distance": distance, "is_success": distance < self.tolerance, **info}

    def _observe(self):
        q, v, tool = self.twin.q[self._q], self.twin.v[self._v], self._tool_position()
        for values, key in ((q, "position_noise"), (v, "velocity_noise")):
            if key in self._drawn:
                values += self._drawn[key] * self.np_random.standard_normal(len(values))
        return numpy.concatenate([q, v, tool, self.target]), math.dist(tool, self.target)

    def _advance(self):
        """One period, in which commands act when their delay is over."""
        end = self._now + self._steps
        while self._now < end:
            while self._pending and self._pending[0][0] <= self._now:
                self.twin.command[self._columns] = self._pending.popleft()[1]
            until = min(end, self._pending[0][0]) if self._pending else end
            self.twin.step(until - self._now)
            self._now = until

    def step(self, action: ArrayLike) -> tuple[NDArray[numpy.float64], float, bool, bool, dict[str, Any]]:
        """Acts for one period; returns observation, reward, terminated, truncated and info."""
        values = numpy.asarray(action, dtype=float)
        if values.shape != self._low.shape or numpy.isnan(values).any():
            refuse("python.shape", f"the action must be {len(self._low)} numbers from -1 to 1 and is {values.tolist()}")
        if not self._running:
            refuse("python.no_reset", "the environment has no episode", "call reset() before the first step()")
        share = 0.5 * (numpy.clip(values, -1.0, 1.0) + 1.0)
        self._pending.append((self._now + self._delay, self._low + share * (self._high - self._low)))
        self._taken += 1
        info: dict[str, Any] = {}
        try:
            self._advance()
            self._last = self._observe()
        except InputError:  # the physics has diverged, and its state may not be finite
            info["diverged"], self._running = True, False
        observation, distance = self._last
        success = distance < self.tolerance and self._running
        info |= {"distance": distance, "is_success": success}
        return observation.copy(), -distance, success, self._taken >= self.max_steps or not self._running, info

    def action_of(self, q: ArrayLike) -> NDArray[numpy.float32]:
        """The action that commands a pose of the arm [arm], in rad or m; beyond a limit that of the limit."""
        share = (numpy.asarray(q, dtype=float) - self._low) / (self._high - self._low)
        return numpy.clip(2.0 * share - 1.0, -1.0, 1.0).astype(numpy.float32)

    def _end_pictures(self):
        if self._camera is not None:
            self._camera.close()
        self._camera = self.twin.camera(self._camera_name) if self.render_mode else None

    def render(self) -> NDArray[numpy.uint8] | None:
        """The newest picture of the camera [height, width, 3]; before the first one of an episode, the one that comes next."""
        if self._camera is None:
            return None
        try:
            return self._camera.rgb.copy()
        except InputError:
            state = self.twin.save()
            self.twin.run_for(1.0 / (self._camera.rate or 25.0) + 2 * self.twin.step_size)
            picture = self._camera.rgb.copy()
            self.twin.restore(state)
            return picture

    def close(self) -> None:
        """Ends the twin."""
        self._running = False
        self.twin.close()


class ReachVectorEnv(VectorEnv):
    """Several ReachEnv at once, stepped by threads; results do not depend on their number."""

    def __init__(self, num_envs: int = 1, *, threads: int = 0, autoreset_mode: Any = "NextStep", **options: Any):
        """threads:        0: one for each processor
        autoreset_mode: "NextStep", "SameStep" or "Disabled", or Gymnasium's AutoresetMode
        options:        of each ReachEnv
        """
        super().__init__()
        if num_envs < 1:
            refuse("python.range", f"num_envs is {num_envs}; it must be at least 1")
        self.num_envs, self._mode = num_envs, AutoresetMode(autoreset_mode)
        self.envs = [ReachEnv(**options) for _ in range(num_envs)]
        first = self.envs[0]
        self.metadata, self.render_mode = {**first.metadata, "autoreset_mode": self._mode}, first.render_mode
        self.single_action_space, self.single_observation_space = first.action_space, first.observation_space
        self.action_space = batch(first.action_space, num_envs)
        self.observation_space = batch(first.observation_space, num_envs)
        count = min(threads or os.cpu_count() or 1, num_envs)
        self._parts = [range(num_envs)[part::count] for part in range(count)]
        self._pool = ThreadPoolExecutor(count) if count > 1 else None
        self._process = os.getpid()  # of the threads, which a fork does not have
        self._observations = numpy.zeros(self.observation_space.shape)
        self._rewards = numpy.zeros(num_envs)
        self._terminated, self._truncated = numpy.zeros((2, num_envs), dtype=bool)

    @property
    def np_random(self) -> tuple[numpy.random.Generator, ...]:
        """The generators of the environments."""
        return tuple(env.np_random for env in self.envs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """Their seeds."""
        return tuple(env.np_random_seed for env in self.envs)

    def _each(self, function, numbers):
        """function(number) of each environment, by the threads; the infos in the order of the environments."""
        if os.getpid() != self._process:
            refuse("python.forked", "the environments belong to the process that made them, and this one is a fork of it",
                   "make them in this process, or start processes by multiprocessing's 'spawn'")
        infos: list[dict] = [{} for _ in self.envs]

        def run(part):
            for number in part:
                if number in numbers:
                    infos[number] = function(number)
        for _ in self._pool.map(run, self._parts) if self._pool else map(run, self._parts):
            pass
        out: dict[str, Any] = {}
        for number in numbers:
            out = self._add_info(out, infos[number], number)
        return out

    def reset(self, *, seed: Any = None, options: Mapping[str, Any] | None = None) -> tuple[NDArray[numpy.float64], dict[str, Any]]:
        """Begins an episode of each. seed: of the first, the others have the next ones; or a list. options: those of ReachEnv, and
        "reset_mask" [num_envs] of bool: only these."""
        seeds = [None if seed is None else seed + number for number in range(self.num_envs)] if (
            seed is None or isinstance(seed, int)) else list(seed)
        rest = dict(options or {})
        mask = numpy.asarray(rest.pop("reset_mask", numpy.ones(self.num_envs, dtype=bool)))
        if len(seeds) != self.num_envs or mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            refuse("python.shape", f"seeds must be {self.num_envs} numbers, and reset_mask {self.num_envs} bool of which one is true")

        def begin(number):
            self._observations[number], info = self.envs[number].reset(seed=seeds[number], options=rest)
            return info
        self._terminated[mask] = self._truncated[mask] = False
        return_infos = self._each(begin, numpy.flatnonzero(mask).tolist())
        return self._observations.copy(), return_infos

    def step(self, actions: ArrayLike) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64], NDArray[numpy.bool_],
                                                NDArray[numpy.bool_], dict[str, Any]]:
        """Acts for one period in each; ended ones begin again as the autoreset mode says."""
        values = numpy.asarray(actions, dtype=float)
        if values.shape != self.action_space.shape:
            refuse("python.shape", f"actions has the shape {list(values.shape)}, and {list(self.action_space.shape)} is needed")
        ended = self._terminated | self._truncated
        if self._mode == AutoresetMode.DISABLED and ended.any():
            refuse("python.no_reset", f"the environment {int(numpy.argmax(ended))} has ended",
                   'call reset(options={"reset_mask": terminated | truncated})')

        def act(number):
            env = self.envs[number]
            if ended[number] and self._mode == AutoresetMode.NEXT_STEP:
                self._observations[number], info = env.reset()
                self._rewards[number], self._terminated[number], self._truncated[number] = 0.0, False, False
                return info
            observation, *outcome, info = env.step(values[number])
            self._rewards[number], self._terminated[number], self._truncated[number] = outcome
            if self._mode == AutoresetMode.SAME_STEP and (outcome[1] or outcome[2]):
                last = {"final_obs": observation, "final_info": info}
                observation, info = env.reset()
                info |= last
            self._observations[number] = observation
            return info
        infos = self._each(act, range(self.num_envs))
        return self._observations.copy(), self._rewards.copy(), self._terminated.copy(), self._truncated.copy(), infos

    def render(self) -> tuple[NDArray[numpy.uint8] | None, ...] | None:
        """The pictures of all."""
        return tuple(env.render() for env in self.envs) if self.render_mode else None

    def close_extras(self, **_: Any) -> None:
        """Ends the twins and threads; close() calls it."""
        if self._pool:
            self._pool.shutdown()
        for env in self.envs:
            env.close()


if gymnasium is not None and "doppel/Reach-v0" not in gymnasium.registry:
    gymnasium.register("doppel/Reach-v0", entry_point="doppel.envs:ReachEnv", vector_entry_point="doppel.envs:ReachVectorEnv")
