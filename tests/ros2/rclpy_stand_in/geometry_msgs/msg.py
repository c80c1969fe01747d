"""Twist and TwistStamped in the layout of idlc's C structs."""
import ctypes


class Vector3(ctypes.Structure):
    _fields_ = [("x", ctypes.c_double), ("y", ctypes.c_double), ("z", ctypes.c_double)]


class Twist(ctypes.Structure):
    _fields_ = [("linear", Vector3), ("angular", Vector3)]


class Time(ctypes.Structure):
    _fields_ = [("sec", ctypes.c_int32), ("nanosec", ctypes.c_uint32)]


class Header(ctypes.Structure):
    _fields_ = [("stamp", Time), ("text", ctypes.c_char_p)]

    @property
    def frame_id(self):
        return (self.text or b"").decode()

    @frame_id.setter
    def frame_id(self, value):
        self.text = value.encode()


class TwistStamped(ctypes.Structure):
    _fields_ = [("header", Header), ("twist", Twist)]
