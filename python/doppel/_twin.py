"""Twin: a simulated robot with its controllers, stepped by the program."""
from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _doppel
from ._actions import message_json, read_result, send_goal
from ._errors import ServiceError, numbers, refuse, seconds, single, whole
from ._model import Model
from ._names import Named, matches

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray


class TwinJoint:
    """One scalar joint of a running robot; its values are the present ones."""

    def __init__(self, robot: TwinRobot, name: str, q_index: int, v_index: int, driven_index: int | None):
        self._robot, self.name = robot, name
        self._q, self._v, self._driven = q_index, v_index, driven_index

    @property
    def q(self) -> float:
        """rad or m"""
        return float(self._robot.q[self._q])

    @property
    def v(self) -> float:
        """rad/s or m/s"""
        return float(self._robot.v[self._v])

    @property
    def effort(self) -> float:
        """N m or N, of the drive in the last step"""
        return float(self._robot.effort[self._v])

    @property
    def command(self) -> float:
        """The position in rad or m that the drive holds; NaN: none. Setting it raises InputError if a controller commands the
        joint."""
        return float(self._robot.command[self._command_index()])

    @command.setter
    def command(self, value: float) -> None:
        index, number = self._command_index(), single("command", value)
        if not math.isnan(number):
            self._robot._t.check_command(self._robot._number, index)
        self._robot.command[index] = number

    def _command_index(self) -> int:
        if self._driven is None:
            refuse("python.not_driven", f"the joint '{self.name}' mimics another one and has no drive",
                   "command the joint that it follows")
        return self._driven

    def __repr__(self):
        return f"<joint {self.name}: q {self.q:.6g}, v {self.v:.6g}, effort {self.effort:.6g}>"


class TwinRobot:
    """One robot of a twin. q [nq], v [nv], effort [nv] and command [driven] are views that step() updates in place: rad, m,
    their rates, N m, N; only command may be written. If the robot is deleted, all but its names raise InputError."""

    def __init__(self, running: _doppel.SteppedTwin, number: int, description: Mapping[str, Any]):
        self._t, self._number = running, number
        self.name: str = description["name"]
        self.namespace: str = description["namespace"]
        self._views: dict[str, NDArray[numpy.float64]] = running.arrays(number)
        self.driven: list[str] = description["driven"]
        joints = [TwinJoint(self, name, q, v, self.driven.index(name) if name in self.driven else None)
                  for name, q, v in description["joints"]]
        self.joints: Named[TwinJoint] = Named("joint", [joint.name for joint in joints], joints)

    def _view(self, name: str) -> NDArray[numpy.float64]:
        self._t.check_present(self._number)
        return self._views[name]

    @property
    def q(self) -> NDArray[numpy.float64]:
        """[nq] rad, m"""
        return self._view("q")

    @property
    def v(self) -> NDArray[numpy.float64]:
        """[nv] rad/s, m/s"""
        return self._view("v")

    @property
    def effort(self) -> NDArray[numpy.float64]:
        """[nv] N m, N, of the drives in the last step"""
        return self._view("effort")

    @property
    def command(self) -> NDArray[numpy.float64]:
        """[driven] rad, m, to be written; NaN: none"""
        return self._view("command")

    def link_poses(self) -> dict[str, NDArray[numpy.float64]]:
        """X_WL [4, 4] of each link in the world, m."""
        return self._t.link_poses(self._number)

    def set_state(self, q: ArrayLike, v: ArrayLike | None = None) -> None:
        """Writes q [nq] and v [nv] (None: at rest). Controllers hold the new pose."""
        import numpy
        positions = numbers("q", q)
        rates = numpy.zeros(len(self.v)) if v is None else numbers("v", v)
        if positions.shape != self.q.shape or rates.shape != self.v.shape:
            refuse("python.shape", f"q and v have the shapes {list(positions.shape)} and {list(rates.shape)}, and "
                   f"{list(self.q.shape)} and {list(self.v.shape)} are needed")
        self._t.set_state(self._number, positions.tolist(), rates.tolist())


class Subscription:
    """The messages of a topic, from now on, as dicts. `depth` of them are kept until they are read."""

    def __init__(self, running: _doppel.SteppedTwin, topic: str, depth: int):
        self._t, self.topic = running, topic
        self._latest: dict[str, Any] | None = None
        running.subscribe(topic, whole("depth", depth, 1))

    def messages(self) -> list[dict[str, Any]]:
        """Those since the last call, the oldest first."""
        out = [json.loads(text) for _, text in self._t.take_messages(self.topic)]
        self._latest = out[-1] if out else self._latest
        return out

    @property
    def latest(self) -> dict[str, Any] | None:
        """The last message; None: none has come."""
        self.messages()
        return self._latest

    def close(self) -> None:
        """Ends it; a camera or lidar that no one reads is not computed."""
        self._t.unsubscribe(self.topic)


class Camera:
    """A camera of a twin. Its pictures come at the camera's rate, with its noise: read them after steps."""

    def __init__(self, running: _doppel.SteppedTwin, sensor: Mapping[str, Any]):
        self._t = running
        self.name: str = sensor["name"]
        self.rate: float = sensor["rate"]  # Hz
        self._topics: list[str] = []
        images = {topic: running.topics().get(topic) for topic in sensor["topics"]}
        for topic, type_name in images.items():
            if type_name == "sensor_msgs/msg/Image":
                running.subscribe(topic, 0)
                self._topics.append(topic)
        self.time: float | None = None  # s, of the picture that was read last

    def _image(self, depth: bool) -> NDArray[Any]:
        import numpy
        for topic in self._topics:
            image = self._t.newest_image(topic)
            if image is None:
                continue
            time, encoding, height, width, row, data = image
            if (encoding in ("32FC1", "16UC1")) != depth:
                continue
            self.time = time
            if encoding == "32FC1":
                return data.view(numpy.float32).reshape(height, row // 4)[:, :width]
            if encoding == "16UC1":
                return data.view(numpy.uint16).reshape(height, row // 2)[:, :width] * numpy.float32(1e-3)
            if encoding in ("rgb8", "bgr8"):
                picture = data.reshape(height, row)[:, :3 * width].reshape(height, width, 3)
                return picture if encoding == "rgb8" else picture[:, :, ::-1]
            if encoding == "mono8":
                return numpy.repeat(data.reshape(height, row)[:, :width, None], 3, axis=2)
        what = "depth" if depth else "picture"
        refuse("python.no_picture", f"the camera '{self.name}' has no {what} yet",
               f"step the twin for {1 / self.rate if self.rate else 0.04:.3g} s or more; a camera may have no {what} at all")

    @property
    def rgb(self) -> NDArray[numpy.uint8]:
        """The newest picture [height, width, 3]; `time` is its time in s."""
        return self._image(False)

    @property
    def depth(self) -> NDArray[numpy.float32]:
        """The newest depths [height, width] in m."""
        return self._image(True)

    def close(self) -> None:
        """Ends its pictures; a camera that no one reads is not computed."""
        for topic in self._topics:
            self._t.unsubscribe(topic)


class Goal:
    """A goal of a controller on its way."""

    def __init__(self, twin: Twin, action: str, goal_id: Mapping[str, Any]):
        self._twin, self._action = twin, action
        self._call = twin._t.begin_call(action + "/_action/get_result", json.dumps({"goal_id": goal_id}))
        self._result: dict[str, Any] | None = None

    @property
    def done(self) -> bool:
        """True: the result is there."""
        if self._result is None:
            text = self._twin._t.take_answer(self._call)
            self._result = None if text is None else json.loads(text)
        return self._result is not None

    def wait(self, timeout: float = 60.0) -> dict[str, Any]:
        """Steps the twin until the goal ends, for at most `timeout` s of simulated time; returns the result. Raises
        ServiceError if it was aborted, cancelled or is not done."""
        if not self.done:
            self._twin._t.step_until_answered(self._call, self._twin._steps_of("timeout", timeout))
            if not self.done:
                raise ServiceError(f"{self._action}: the goal is not done after {timeout} s")
        return read_result(self._action, self._result)


class Controller:
    """A controller of a twin."""

    def __init__(self, twin: Twin, prefix: str, name: str, type_name: str, claimed: Sequence[str]):
        self._twin, self._node, self.name, self.type = twin, f"{prefix}/{name}", name, type_name
        self.joints: list[str] = list(dict.fromkeys(interface.rpartition("/")[0] for interface in claimed))

    @overload
    def follow(self, times: ArrayLike, positions: ArrayLike, wait: Literal[True] = True) -> dict[str, Any]: ...

    @overload
    def follow(self, times: ArrayLike, positions: ArrayLike, wait: Literal[False]) -> Goal: ...

    def follow(self, times: ArrayLike, positions: ArrayLike, wait: bool = True) -> Goal | dict[str, Any]:
        """Sends a trajectory: at times [n] in s from now the joints are at positions [n, joints] in rad or m, in the order of
        `joints`. With wait, the twin is stepped until the end, and the result returned. Raises ServiceError if it is refused
        or ends otherwise than at the goal."""
        action = self._node + "/follow_joint_trajectory"
        self._twin._goals += 1  # numbered, so that equal runs are equal

        def reason():
            lines = [text for _, origin, text in self._twin.log() if self.name in origin]
            return f": {lines[-1]}" if lines else ""
        goal_id, duration = send_goal(self._twin.call, action, self.joints, times, positions,
                                      self._twin._goals.to_bytes(16, "big"), reason)
        sent = Goal(self._twin, action, goal_id)
        return sent.wait(duration + 30.0) if wait else sent

    def __repr__(self):
        return f"<controller {self.name} ({self.type}): {', '.join(self.joints)}>"


class Recording:
    """A recording in progress; its file is complete after stop() or the end of a with block."""

    def __init__(self, running: _doppel.SteppedTwin, file: str):
        self._t, self.file = running, file
        running.record(file)

    def stop(self) -> int:
        """Ends it; returns the number of messages."""
        return self._t.stop_recording()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


class Page:
    """The page of a twin, at `url`; a notebook shows it."""

    def __init__(self, url: str):
        self.url = url

    @property
    def port(self) -> int:
        """Of the server, for Client(port)."""
        return int(self.url.partition("//")[2].partition("/")[0].rpartition(":")[2])

    def __repr__(self):
        return f"<page {self.url}>"

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" style="width: 100%; height: 600px; border: 0"></iframe>'


class Twin:
    """A twin of one robot or several, in one world with one clock; it runs only while it is stepped.

    q [nq], v [nv], effort [nv] and command [driven] are those of the first robot: views that step() updates in place. Calls
    release the interpreter's lock. Several threads may use a twin: they take turns, within a long call too. A process that
    os.fork() makes may read the arrays of its parent's twins and close them, which has no effect on the parent.
    """

    def __init__(self, model: Model | str | os.PathLike[str] | Sequence[Model | str | os.PathLike[str]] = (), *, world: str | os.PathLike[str] | None = None,
                 engine: str = "mujoco", seed: int = 0, step: float | None = None,
                 controllers: bool | str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = True, activate: Sequence[str] = (),
                 namespaces: Sequence[str] = (), ideal: bool = False):
        """model:       a Model, or the source of one (Model.load), or a list of them
        world:       a world file, YAML or SDF; None: a ground
        engine:      "mujoco" or "bullet"
        seed:        of the sensors' noise
        step:        s; None: the world's, or what the controllers' rates need
        controllers: True: those of the description; False: none, so that `command` drives the joints; or YAML files
        activate:    names of controllers to start; empty: all
        namespaces:  of the robots, in their order
        ideal:       joints follow commands exactly, under any load

        Raises InputError.
        """
        models = [model] if isinstance(model, (Model, str, os.PathLike)) else list(model)
        self._models = [one if isinstance(one, Model) else Model.load(one) for one in models]
        files = [] if isinstance(controllers, bool) else [controllers] if isinstance(controllers, (str, os.PathLike)) else controllers
        if step is not None and not 0 < seconds("step", step) <= 1:
            refuse("python.range", f"step is {step!r}; it must be a time in s above 0, and at most 1")
        options = dict(world=None if world is None else os.fspath(world), engine=engine, seed=whole("seed", seed, 0, 2**64 - 1), step=step, ideal=ideal,
                       controllers=controllers is not False, controller_files=[os.fspath(file) for file in files],
                       activate=list(activate))
        self._t = _doppel.make_twin([one._m for one in self._models], list(namespaces), options)
        robots = [TwinRobot(self._t, number, robot) for number, robot in enumerate(self._t.robots())]
        self._robots: Named[TwinRobot] = Named("robot", [robot.namespace or robot.name for robot in robots], robots)
        self._goals = 0

    def __enter__(self) -> Twin:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends recordings and the twin. Its arrays stay readable."""
        self._t.close()

    @property
    def time(self) -> float:
        """s, simulated, since the start or the last reset"""
        return self._t.time

    @property
    def step_size(self) -> float:
        """s, of one step"""
        return self._t.step_size

    @property
    def steps(self) -> int:
        """The number of steps since the start or the last reset."""
        return self._t.steps

    @property
    def state_hash(self) -> int:
        """Of all states so far: equal runs have the same number."""
        return self._t.state_hash

    @property
    def q(self) -> NDArray[numpy.float64]:
        """[nq] rad, m, of the first robot"""
        return self._first.q

    @property
    def v(self) -> NDArray[numpy.float64]:
        """[nv] rad/s, m/s, of the first robot"""
        return self._first.v

    @property
    def effort(self) -> NDArray[numpy.float64]:
        """[nv] N m, N, of the drives of the first robot in the last step"""
        return self._first.effort

    @property
    def command(self) -> NDArray[numpy.float64]:
        """[driven] rad, m, of the first robot, to be written; NaN: none"""
        return self._first.command

    @property
    def _first(self) -> TwinRobot:
        if not self._robots:
            refuse("python.no_robot", "the twin has no robot", "pass a model, or a world with one")
        return self._robots[0]

    @property
    def robots(self) -> Named[TwinRobot]:
        """By number, and by namespace or name."""
        return self._robots

    @property
    def model(self) -> Model:
        """The model of the first robot."""
        return self._models[0]

    @property
    def joints(self) -> Named[TwinJoint]:
        """The scalar joints of the first robot."""
        return self._first.joints

    @property
    def warnings(self) -> list[dict[str, Any]]:
        """What the start has reported: a list of dicts."""
        return self._t.diagnostics

    def __repr__(self):
        if self._t.closed:
            return "<doppel.Twin, closed>"
        return f"<doppel.Twin {', '.join(self.robots.names)}: t = {self.time:.6g} s>"

    def step(self, n: int = 1) -> None:
        """n steps of step_size with the present commands. Raises InputError if the physics diverges."""
        self._t.step(whole("n", n))

    def run_for(self, seconds: float, speed: float | None = None) -> None:
        """As many steps as this simulated time has, rounded. speed: simulated s per s of wall-clock time, for a person who looks
        on; None: as fast as possible."""
        steps = self._steps_of("seconds", seconds)
        if speed is None:
            return self._t.step(steps)
        if not single("speed", speed) > 0:
            refuse("python.range", f"speed is {speed!r}; it must be above zero, or None")
        part, start, taken = max(1, round(0.01 * speed / self.step_size)), time.monotonic(), 0
        while taken < steps:
            self._t.step(min(part, steps - taken))
            taken += part
            time.sleep(max(0.0, start + min(taken, steps) * self.step_size / speed - time.monotonic()))

    def _steps_of(self, name: str, time: float) -> int:
        return round(seconds(name, time) / self.step_size)

    def view(self, port: int = 0, open: bool = False) -> Page:
        """Serves the page of doppel, which shows what steps do; it also answers `doppel topic` and the other verbs while the twin is
        stepped. port: 0: 8700 or the next that is free. open: in the desktop's browser."""
        page = Page(self._t.view(whole("port", port, 0, 65535)))
        if open:
            import webbrowser
            webbrowser.open(page.url)
        return page

    def reset(self) -> None:
        """To the start: time 0, start poses, at rest, commands NaN; controllers hold there."""
        self._t.reset()

    def set_state(self, q: ArrayLike, v: ArrayLike | None = None) -> None:
        """Writes q [nq] and v [nv] (None: at rest) of the first robot; controllers hold the new pose."""
        self._first.set_state(q, v)

    def save(self) -> _doppel.SavedState:
        """The whole state, for restore(): physics, controllers, sensors, time. It has `time` and `steps`."""
        return self._t.save()

    def restore(self, state: _doppel.SavedState) -> None:
        """Continues from a saved state of this twin, bit-identically."""
        self._t.restore(state)

    def joint(self, name: str) -> TwinJoint:
        """A scalar joint of the first robot."""
        return self.joints[name]

    def controllers(self) -> dict[str, dict[str, Any]]:
        """Name to type, state ("active", "inactive", "unconfigured"), claimed interfaces and namespace."""
        out = {}
        for robot in self._t.robots():
            for name, type_name, state, claimed in robot["controllers"]:
                key = f"{robot['namespace']}/{name}" if robot["namespace"] else name
                out[key] = dict(type=type_name, state=state, claimed=claimed, namespace=robot["namespace"])
        return out

    def controller(self, name: str) -> Controller:
        """A controller by its name or, if only one has it, a part of it: "arm"."""
        known = self.controllers()
        found = matches(name, list(known))
        if len(found) != 1:
            near = _doppel.did_you_mean(name, list(known))
            refuse("python.unknown_name", f"there {'are several controllers' if found else 'is no controller'} '{name}'{near}",
                   f"the controllers are {', '.join(known)}")
        one = known[found[0]]
        prefix = f"/{one['namespace']}" if one["namespace"] else ""
        return Controller(self, prefix, found[0].rpartition("/")[2], one["type"], one["claimed"])

    # -- the bus
    def topics(self) -> dict[str, str]:
        """Topics and their types."""
        return self._t.topics()

    def services(self) -> dict[str, str]:
        """Services and their types."""
        return self._t.services()

    def publish(self, topic: str, message: Mapping[str, Any], type: str = "") -> None:
        """Publishes a message, a dict of its fields; those that are left out have their defaults. The type is that of the
        topic. It is received before the next step."""
        self._t.publish(topic, type, message_json(message))

    def subscribe(self, topic: str, depth: int = 10) -> Subscription:
        """The messages of a topic from now on, of a latched one also its last."""
        return Subscription(self._t, topic, depth)

    def call(self, service: str, request: Mapping[str, Any] | None = None, timeout: float = 10.0) -> dict[str, Any]:
        """Calls a service and returns its response. Time does not pass unless the service needs steps, then at most `timeout` s of
        simulated time. A service that computes beside the twin (the spawning of a robot) has as long by the wall clock, because
        a small twin steps through those seconds in a moment. Raises ServiceError if it is refused."""
        end = time.monotonic() + timeout
        steps = self._steps_of("timeout", timeout)
        number = self._t.begin_call(service, message_json(request or {}))
        text = self._answer(service, number)
        if text is None:
            self._t.step_until_answered(number, steps)
            text = self._answer(service, number)
        while text is None and time.monotonic() < end:
            time.sleep(0.001)
            text = self._answer(service, number)
        if text is None:
            raise ServiceError(f"{service} has not answered in {timeout} s")
        return json.loads(text)

    def _answer(self, service: str, number: int) -> str | None:
        try:
            return self._t.take_answer(number)
        except ValueError as error:
            raise ServiceError(f"{service}: {error}") from None

    def parameters(self, node: str | None = None) -> dict[str, Any]:
        """{node: {name: value}}, or {name: value} of one node."""
        known = self._t.parameters()
        if node is None:
            return known
        return Named("node", known, known.values())[node]

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Sets one parameter; raises InputError with the reason if the node refuses it."""
        self._t.set_parameter(node, name, value)

    # -- sensors, recordings, log
    def sensors(self) -> list[dict[str, Any]]:
        """Cameras, lidars and range sensors: name, type, topics, frame, rate in Hz."""
        return self._t.sensors()

    def camera(self, name: str) -> Camera:
        """A camera by a part of its name."""
        types = self.topics()
        cameras = [one for one in self.sensors() if "sensor_msgs/msg/Image" in {types.get(topic) for topic in one["topics"]}]
        names = [one["name"] for one in cameras]
        found = matches(name, names)
        if len(found) != 1:
            refuse("python.unknown_name", f"there {'are several cameras' if found else 'is no camera'} '{name}'",
                   f"the cameras are {', '.join(names)}" if names else "the robot has no camera; add one to its description")
        return Camera(self._t, cameras[names.index(found[0])])

    def record(self, file: str | os.PathLike[str]) -> Recording:
        """Records all topics from now on into one MCAP file. With a recording before the first step, `doppel bag resimulate`
        can run it again."""
        return Recording(self._t, os.fspath(file))

    def log(self) -> list[tuple[str, str, str]]:
        """The lines since the last call: severity, origin, text."""
        return self._t.take_log()
