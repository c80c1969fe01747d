"""What teleop_twist_keyboard uses of rclpy, over Cyclone DDS: a participant, writers with ROS 2's default QoS, parameters and
names from --ros-args. For tests on machines without ROS; it shares no code with doppel.

CYCLONE_TYPES is a library with idlc's types that links Cyclone DDS (tests/ros2/CMakeLists.txt), ROS_DOMAIN_ID the domain, on loopback only.
"""
import ctypes
import os
import sys
import threading
import time

from geometry_msgs import msg as messages

from . import parameter

_dds = ctypes.CDLL(os.environ["CYCLONE_TYPES"])
_dds.dds_create_qos.restype = ctypes.c_void_p

_LOOPBACK = ("<CycloneDDS><Domain Id='any'><General><AllowMulticast>false</AllowMulticast>"
             "<Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces></General>"
             "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
             "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>")
_RELIABLE, _VOLATILE, _KEEP_LAST = 1, 0, 0

_parameters, _names, _ended = {}, {}, threading.Event()


def _must(result, what):
    if result < 0:
        raise RuntimeError(f"{what}: Cyclone DDS's error {result}")
    return result


def init():
    words = sys.argv[sys.argv.index("--ros-args") + 1:] if "--ros-args" in sys.argv else []
    for option, word in zip(words[::2], words[1::2]):
        key, _, value = word.partition(":=")
        {"-p": _parameters, "-r": _names}[option][key] = value


def shutdown():
    _ended.set()


def spin(node):
    _ended.wait()


def create_node(name):
    return Node(name)


class _Parameter:
    def __init__(self, value):
        self.value = value


class _Clock:
    def now(self):
        return self

    def to_msg(self):
        whole, part = divmod(time.time_ns(), 1_000_000_000)
        return messages.Time(whole, part)


class Publisher:
    def __init__(self, participant, message, topic, depth):
        descriptor = ctypes.c_char.in_dll(_dds, f"geometry_msgs_msg_dds__{message.__name__}__desc")
        entity = _must(_dds.dds_create_topic(participant, ctypes.byref(descriptor), f"rt{topic}".encode(), None, None), topic)
        qos = ctypes.c_void_p(_dds.dds_create_qos())
        _dds.dds_qset_reliability(qos, _RELIABLE, ctypes.c_int64(1_000_000_000))
        _dds.dds_qset_durability(qos, _VOLATILE)
        _dds.dds_qset_history(qos, _KEEP_LAST, depth)
        self._writer = _must(_dds.dds_create_writer(participant, entity, qos, None), "a writer")
        _dds.dds_delete_qos(qos)

    def publish(self, message):
        _must(_dds.dds_write(self._writer, ctypes.byref(message)), "writing")


class Node:
    def __init__(self, name):
        self._name = name
        os.environ["CYCLONEDDS_URI"] = _LOOPBACK
        self._participant = _must(
            _dds.dds_create_participant(ctypes.c_uint32(int(os.environ["ROS_DOMAIN_ID"])), None, None), "a participant")

    def declare_parameter(self, name, value):
        kind = str if isinstance(value, parameter.Parameter.Type) else type(value)
        if name not in _parameters:
            return _Parameter(None if isinstance(value, parameter.Parameter.Type) else value)
        text = _parameters[name]
        return _Parameter(text == "true" if kind is bool else kind(text))

    def create_publisher(self, message, topic, depth):
        name = _names.get(topic, topic)
        return Publisher(self._participant, message, name if name.startswith("/") else "/" + name, depth)

    def get_clock(self):
        return _Clock()
