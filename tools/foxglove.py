"""A small client of the Foxglove WebSocket protocol, and a running twin, for the load programs of this folder."""

import base64
import json
import os
import socket
import struct
import subprocess
import time


def frame(payload, opcode=1):
    """One masked WebSocket frame of a client; the mask is zero."""
    data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
    size = len(data)
    if size < 126:
        head = bytes([0x80 | opcode, 0x80 | size])
    elif size < 65536:
        head = bytes([0x80 | opcode, 0xFE]) + struct.pack(">H", size)
    else:
        head = bytes([0x80 | opcode, 0xFF]) + struct.pack(">Q", size)
    return head + b"\0\0\0\0" + data


class Client:
    """A blocking client. OSError: the server does not accept it."""

    def __init__(self, port, timeout=30):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=timeout)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n".encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            self._more()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0] + b" ":
            raise OSError(head.split(b"\r\n")[0].decode())

    def _more(self):
        data = self.socket.recv(1 << 20)
        if not data:
            raise OSError("the server closed the connection")
        self.buffer += data

    def send(self, payload, opcode=1):
        self.socket.sendall(frame(payload, opcode))

    def receive(self):
        """The next message: a dict of a text frame, or the bytes of a binary one."""
        while True:
            if len(self.buffer) >= 2:
                opcode, size, start = self.buffer[0] & 15, self.buffer[1] & 127, 2
                if size == 126 and len(self.buffer) >= 4:
                    size, start = struct.unpack(">H", self.buffer[2:4])[0], 4
                elif size == 127 and len(self.buffer) >= 10:
                    size, start = struct.unpack(">Q", self.buffer[2:10])[0], 10
                if (size < 126 or start > 2) and len(self.buffer) >= start + size:
                    data, self.buffer = self.buffer[start:start + size], self.buffer[start + size:]
                    if opcode == 1:
                        return json.loads(data)
                    if opcode == 2:
                        return data
                    if opcode == 9:  # the server closes connections that do not answer its pings
                        self.send(data, 10)
                    if opcode == 8:
                        raise OSError("closed: " + data[2:].decode(errors="replace"))
                    continue
            self._more()

    def offers(self):
        """The topics and services by name, each with its id and schema name, from the greeting."""
        topics, services = {}, {}
        while not services:
            message = self.receive()
            if not isinstance(message, dict):
                continue
            if message["op"] == "advertise":
                topics = {c["topic"]: (c["id"], c["schemaName"]) for c in message["channels"]}
            if message["op"] == "advertiseServices":
                services = {s["name"]: (s["id"], s["type"]) for s in message["services"]}
        return topics, services


class Twin:
    """`doppel up` in the background, ready when the constructor returns."""

    def __init__(self, program, arguments, port, log, **process):
        self.log = open(log, "w+")
        self.port = port
        self.process = subprocess.Popen([program, "up", *arguments, "--headless", "--no-ros", "--port", str(port)],
                                        stdout=self.log, stderr=subprocess.STDOUT, **process)
        for _ in range(600):
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                time.sleep(0.3)  # in which it would end if another twin had the port
                if self.process.poll() is None:
                    return
                break
            except OSError:
                if self.process.poll() is not None:
                    break
                time.sleep(0.1)
        raise SystemExit(f"the twin did not start; its output is in {log}")

    def alive(self):
        return self.process.poll() is None

    def memory_mb(self):
        with open(f"/proc/{self.process.pid}/status") as status:
            for line in status:
                if line.startswith("VmRSS"):
                    return int(line.split()[1]) / 1024
        return 0.0

    def text(self):
        with open(self.log.name, errors="replace") as log:
            return log.read()

    def end(self):
        self.process.terminate()
        return self.process.wait(timeout=30)
