"""Client: a twin that runs in another process, or a robot on a ROS 2 network."""
from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from ._actions import message_json, read_result, send_goal
from ._errors import refuse, seconds, whole
from ._names import Named, matches

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class ClientSubscription:
    """The messages of a topic as dicts; `depth` of them are kept until they are read."""

    def __init__(self, client: Client, topic: str, depth: int):
        self._client, self.topic = client, topic
        self._kept: deque[dict[str, Any]] = deque(maxlen=whole("depth", depth, 1))
        self._latest: dict[str, Any] | None = None
        client._heard.setdefault(topic, []).append(self)
        client._c.subscribe(topic)

    def wait(self, timeout: float = 10.0) -> dict[str, Any]:
        """The next message; raises TimeoutError if none comes in `timeout` s."""
        until = time.monotonic() + seconds("timeout", timeout)
        while not self._kept:
            if not self._client._receive(until):
                raise TimeoutError(f"{self.topic}: no message in {timeout} s")
        return self._kept.popleft()

    def messages(self) -> list[dict[str, Any]]:
        """Those that have come and were not read, the oldest first."""
        self._client._receive_all()
        out = list(self._kept)
        self._kept.clear()
        return out

    @property
    def latest(self) -> dict[str, Any] | None:
        """The last message; None: none has come."""
        self._client._receive_all()
        return self._latest

    def close(self) -> None:
        """Ends it."""
        self._client._heard[self.topic].remove(self)
        if not self._client._heard[self.topic]:
            self._client._c.unsubscribe(self.topic)


class ClientController:
    """A controller of a running twin or robot."""

    def __init__(self, client: Client, prefix: str, name: str, type_name: str, claimed: Sequence[str]):
        self._client, self._node, self.name, self.type = client, f"{prefix}/{name}", name, type_name
        self.joints: list[str] = list(dict.fromkeys(interface.rpartition("/")[0] for interface in claimed))

    def follow(self, times: ArrayLike, positions: ArrayLike, timeout: float | None = None) -> dict[str, Any]:
        """Sends a trajectory and waits for its end: at times [n] in s from now the joints are at positions [n, joints] in rad or
        m, in the order of `joints`. A real arm moves. Raises ServiceError if it is refused or ends otherwise than at the goal, or
        not within `timeout` s of wall-clock time (None: the trajectory's duration and 30 s)."""
        action = self._node + "/follow_joint_trajectory"
        goal_id, duration = send_goal(self._client.call, action, self.joints, times, positions)
        limit = duration + 30.0 if timeout is None else timeout
        return read_result(action, self._client.call(action + "/_action/get_result", {"goal_id": goal_id}, timeout=limit))


class _Closed:
    def __getattr__(self, name: str) -> NoReturn:
        refuse("python.closed", "the client is closed", "use it inside its with block, or make another one")


class Client:
    """Access to what runs elsewhere, in wall-clock time: topics, services and parameters as dicts, and controllers."""

    def __init__(self, port: int = 0, *, host: str = "127.0.0.1", token: str = "", ros: bool = False):
        """port: of a twin's server; 0: the newest twin of this machine
        ros:  the ROS 2 network of ROS_DOMAIN_ID instead of a twin

        Raises InputError or ServiceError if there is none.
        """
        from . import _doppel_tools
        self._c: Any = _doppel_tools.GraphAccess(host, whole("port", port, 0, 65535), token, ros)
        self._heard: dict[str, list[ClientSubscription]] = {}

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection."""
        self._c = _Closed()

    def topics(self) -> dict[str, str]:
        """Topics and their types."""
        return self._c.topics()

    def services(self) -> dict[str, str]:
        """Services and their types."""
        return self._c.services()

    def nodes(self) -> list[str]:
        """The names of the nodes, sorted."""
        return self._c.nodes()

    def publish(self, topic: str, message: Mapping[str, Any], type: str = "") -> None:
        """Publishes a message, a dict of its fields; those that are left out have their defaults."""
        self._c.publish(topic, type, message_json(message))

    def subscribe(self, topic: str, depth: int = 10) -> ClientSubscription:
        """The messages of a topic from now on."""
        return ClientSubscription(self, topic, depth)

    def call(self, service: str, request: Mapping[str, Any] | None = None, timeout: float = 10.0) -> dict[str, Any]:
        """Calls a service and returns its response, which comes within `timeout` s. Raises ServiceError."""
        return json.loads(self._c.call(service, message_json(request or {}), seconds("timeout", timeout)))

    def parameters(self, node: str | None = None) -> dict[str, Any]:
        """{node: {name: value}}, or {name: value} of one node."""
        known = self._c.parameters(node or "")
        return known if node is None else Named("node", known, known.values())[node]

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Sets one parameter; raises InputError with the reason if the node refuses it."""
        self._c.set_parameter(node, name, value)

    def positions(self, topic: str = "/joint_states", timeout: float = 10.0) -> dict[str, float]:
        """The present position of each joint, in rad or m."""
        states = self.subscribe(topic)
        try:
            message = states.wait(timeout)
        finally:
            states.close()
        return dict(zip(message["name"], message["position"]))

    def controller(self, name: str, namespace: str = "") -> ClientController:
        """A controller of the controller manager in a namespace, by its name or a part of it: "arm"."""
        prefix = f"/{namespace.strip('/')}" if namespace else ""
        known = {one["name"]: one for one in self.call(prefix + "/controller_manager/list_controllers")["controller"]}
        found = matches(name, list(known))
        if len(found) != 1:
            refuse("python.unknown_name", f"there {'are several controllers' if found else 'is no controller'} '{name}'",
                   f"the controllers are {', '.join(known)}")
        one = known[found[0]]
        return ClientController(self, prefix, found[0], one["type"], one["claimed_interfaces"])

    def _receive(self, until: float) -> bool:
        received = self._c.next(max(0.0, until - time.monotonic()))
        if received is None:
            return False
        message = json.loads(received[1])
        for subscription in self._heard.get(received[0], ()):
            subscription._kept.append(message)
            subscription._latest = message
        return True

    def _receive_all(self) -> None:
        while self._receive(time.monotonic()):
            pass
