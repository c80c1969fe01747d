#!/usr/bin/env python3
"""A host that does to six STS3215 what LeRobot does, by the bytes of the vendor's SDK, without either of them.

The sequences are those of LeRobot 0.6 (motors/feetech/feetech.py, motors/motors_bus.py, robots/so_follower, cameras/zmq).

  host.py calibrate PORT FILE SECONDS       handshake, configuration, homing offsets, ranges, the file; fails after SECONDS
  host.py teleoperate LEADER FOLLOWER FILE RECORD SECONDS [CAMERAS]   30 Hz; CAMERAS: port of ZeroMQ
  host.py replay FOLLOWER FILE RECORD       the actions of a record; prints the largest difference of its observations
"""
import base64
import json
import os
import select
import sys
import termios
import time
import tty

MOTORS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
IDS = {name: number + 1 for number, name in enumerate(MOTORS)}
FRAMES_PER_SECOND = 30
RESOLUTION = 4096
AWAY, STILL = 200, 3  # ticks
STILL_TIME = 0.4  # s
RETRIES = 4
NEAR = 8  # frames
PING, READ, WRITE, SYNC_READ, SYNC_WRITE, BROADCAST = 1, 2, 3, 0x82, 0x83, 0xFE
# Address, bytes, bit of the sign.
REGISTERS = {"Firmware_Major_Version": (0, 1, None), "Firmware_Minor_Version": (1, 1, None), "Model_Number": (3, 2, None),
             "Return_Delay_Time": (7, 1, None), "Min_Position_Limit": (9, 2, None), "Max_Position_Limit": (11, 2, None),
             "Max_Torque_Limit": (16, 2, None), "P_Coefficient": (21, 1, None), "D_Coefficient": (22, 1, None),
             "I_Coefficient": (23, 1, None), "Protection_Current": (28, 2, None), "Homing_Offset": (31, 2, 11),
             "Operating_Mode": (33, 1, None), "Overload_Torque": (36, 1, None), "Torque_Enable": (40, 1, None),
             "Acceleration": (41, 1, None), "Goal_Position": (42, 2, 15), "Lock": (55, 1, None),
             "Present_Position": (56, 2, 15), "Maximum_Acceleration": (85, 1, None)}


def to_bytes(value, size, sign):
    if sign is not None and value < 0:
        value = -value | 1 << sign
    return value.to_bytes(size, "little")


def from_bytes(data, sign):
    value = int.from_bytes(data, "little")
    if sign is not None and value >> sign & 1:
        return -(value & ~(1 << sign))
    return value


class Bus:
    """One half-duplex bus at 1 Mbit/s, as the SDK's PortHandler and protocol_packet_handler use it."""

    def __init__(self, path):
        self.repeated = 0
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.port)
        attributes = termios.tcgetattr(self.port)
        attributes[4] = attributes[5] = getattr(termios, "B1000000")
        termios.tcsetattr(self.port, termios.TCSANOW, attributes)

    def send(self, motor, instruction, parameters=b""):
        body = bytes([motor, len(parameters) + 2, instruction]) + bytes(parameters)
        termios.tcflush(self.port, termios.TCIFLUSH)
        os.write(self.port, b"\xff\xff" + body + bytes([~sum(body) & 0xFF]))

    def receive(self, size, patience=0.3):
        """A status packet with that many bytes of data."""
        due, got = time.perf_counter() + patience, b""
        while len(got) < size + 6:
            left = due - time.perf_counter()
            if left <= 0 or not select.select([self.port], [], [], left)[0]:
                raise TimeoutError(f"no status packet: {len(got)} of {size + 6} bytes")
            got += os.read(self.port, size + 6 - len(got))
        if got[:2] != b"\xff\xff" or got[-1] != ~sum(got[2:-1]) & 0xFF:
            raise TimeoutError(f"a damaged status packet: {got.hex(' ')}")
        return got[2], got[4], got[5:-1]

    def ask(self, motor, instruction, parameters, sizes):
        """The answers to a request, which is repeated as with LeRobot's num_retry: a busy machine answers late."""
        for _ in range(RETRIES):
            try:
                self.send(motor, instruction, parameters)
                return [self.receive(size) for size in sizes]
            except TimeoutError as late:
                self.repeated += 1
                why = late
        raise SystemExit(str(why))

    def ping(self, motor):
        (answered, error, _), = self.ask(motor, PING, b"", [0])
        assert answered == motor and error == 0, (answered, error)
        return self.read("Model_Number", motor)

    def read(self, register, motor):
        address, size, sign = REGISTERS[register]
        (answered, error, data), = self.ask(motor, READ, bytes([address, size]), [size])
        assert answered == motor and error == 0, (register, answered, error)
        return from_bytes(data, sign)

    def write(self, register, motor, value):
        address, size, sign = REGISTERS[register]
        (answered, error, _), = self.ask(motor, WRITE, bytes([address]) + to_bytes(value, size, sign), [0])
        assert answered == motor and error == 0, (register, answered, error)

    def sync_read(self, register):
        address, size, sign = REGISTERS[register]
        answers = self.ask(BROADCAST, SYNC_READ, bytes([address, size, *IDS.values()]), [size] * len(IDS))
        out = {}
        for (name, motor), (answered, _, data) in zip(IDS.items(), answers):
            assert answered == motor, (answered, motor)
            out[name] = from_bytes(data, sign)
        return out

    def sync_write(self, register, values):
        address, size, sign = REGISTERS[register]
        data = b"".join(bytes([IDS[name]]) + to_bytes(value, size, sign) for name, value in values.items())
        self.send(BROADCAST, SYNC_WRITE, bytes([address, size]) + data)

    # -- as FeetechMotorsBus

    def connect(self):
        """The handshake: every motor is there with its model, and all have the same firmware."""
        models = {name: self.ping(motor) for name, motor in IDS.items()}
        assert set(models.values()) == {777}, models
        firmware = {(self.read("Firmware_Major_Version", m), self.read("Firmware_Minor_Version", m)) for m in IDS.values()}
        assert len(firmware) == 1, firmware

    def set_torque(self, on):
        for motor in IDS.values():
            self.write("Torque_Enable", motor, int(on))
            self.write("Lock", motor, int(on))

    def configure(self):
        self.set_torque(False)
        for motor in IDS.values():
            for register, value in (("Return_Delay_Time", 0), ("Maximum_Acceleration", 254), ("Acceleration", 254),
                                    ("Operating_Mode", 0), ("P_Coefficient", 16), ("I_Coefficient", 0), ("D_Coefficient", 32)):
                self.write(register, motor, value)
        for register, value in (("Max_Torque_Limit", 500), ("Protection_Current", 250), ("Overload_Torque", 25)):
            self.write(register, IDS["gripper"], value)

    def set_half_turn_homings(self):
        for motor in IDS.values():
            self.write("Homing_Offset", motor, 0)
            self.write("Min_Position_Limit", motor, 0)
            self.write("Max_Position_Limit", motor, RESOLUTION - 1)
        homings = {name: position - (RESOLUTION - 1) // 2 for name, position in self.sync_read("Present_Position").items()}
        for name, offset in homings.items():
            self.write("Homing_Offset", IDS[name], offset)
        return homings

    def write_calibration(self, calibration):
        for name, one in calibration.items():
            self.write("Homing_Offset", IDS[name], one["homing_offset"])
            self.write("Min_Position_Limit", IDS[name], one["range_min"])
            self.write("Max_Position_Limit", IDS[name], one["range_max"])

    def is_calibrated(self, calibration):
        return all(self.read(register, IDS[name]) == one[key] for name, one in calibration.items()
                   for register, key in (("Homing_Offset", "homing_offset"), ("Min_Position_Limit", "range_min"),
                                         ("Max_Position_Limit", "range_max")))


def to_degrees(calibration, ticks):
    """LeRobot's normalisation with use_degrees: the gripper in percent, the others in degrees from the middle of the range."""
    out = {}
    for name, tick in ticks.items():
        low, high = calibration[name]["range_min"], calibration[name]["range_max"]
        if name == "gripper":
            out[name] = 100 * (min(max(tick, low), high) - low) / (high - low)
        else:
            out[name] = (tick - (low + high) / 2) * 360 / (RESOLUTION - 1)
    return out


def to_ticks(calibration, values):
    out = {}
    for name, value in values.items():
        low, high = calibration[name]["range_min"], calibration[name]["range_max"]
        if name == "gripper":
            out[name] = int(min(max(value, 0), 100) / 100 * (high - low) + low)
        else:
            out[name] = int(value * (RESOLUTION - 1) / 360 + (low + high) / 2)
    return out


class Cameras:
    """The last message of a PUB socket, as LeRobot's ZMQCamera gets it."""

    def __init__(self, port):
        import zmq
        self.again = zmq.Again
        self.socket = zmq.Context().socket(zmq.SUB)
        self.socket.setsockopt_string(zmq.SUBSCRIBE, "")
        self.socket.setsockopt(zmq.CONFLATE, True)
        self.socket.setsockopt(zmq.RCVTIMEO, 5000)
        self.socket.connect(f"tcp://127.0.0.1:{port}")
        self.last = json.loads(self.socket.recv_string())

    def latest(self):
        try:
            import zmq
            self.last = json.loads(self.socket.recv_string(zmq.NOBLOCK))
        except self.again:
            pass
        return self.last


class Ticker:
    """Frames at a steady rate, and how many of them ended late."""

    def __init__(self):
        self.start, self.frame, self.late = time.perf_counter(), 0, 0

    def wait(self):
        self.frame += 1
        due = self.start + self.frame / FRAMES_PER_SECOND
        self.late += time.perf_counter() > due
        while time.perf_counter() < due:
            time.sleep(min(0.001, max(0, due - time.perf_counter())))


def wait_until_still(bus, due):
    """The hand holds the arm in the middle of its ranges for a while, before it moves the first joint."""
    before, since = bus.sync_read("Present_Position"), time.perf_counter()
    while time.perf_counter() - since < STILL_TIME:
        assert time.perf_counter() < due, "the arm is never still"
        now = bus.sync_read("Present_Position")
        if max(abs(now[name] - before[name]) for name in MOTORS) > STILL:
            before, since = now, time.perf_counter()


def calibrate(port, file, seconds):
    bus = Bus(port)
    bus.connect()
    bus.configure()
    due = time.perf_counter() + float(seconds)
    wait_until_still(bus, due)
    homings = bus.set_half_turn_homings()
    least = bus.sync_read("Present_Position")
    most = dict(least)
    middle = RESOLUTION // 2
    swept = set()  # motors that have come back from both of their ends
    while len(swept) < len(MOTORS):
        assert time.perf_counter() < due, f"only {sorted(swept)} were swept"
        for name, tick in bus.sync_read("Present_Position").items():
            least[name], most[name] = min(tick, least[name]), max(tick, most[name])
            if least[name] + AWAY < min(tick, middle) and max(tick, middle) < most[name] - AWAY:
                swept.add(name)
    least["wrist_roll"], most["wrist_roll"] = 0, RESOLUTION - 1  # of a joint that turns through
    calibration = {name: {"id": IDS[name], "drive_mode": 0, "homing_offset": homings[name], "range_min": least[name],
                          "range_max": most[name]} for name in MOTORS}
    bus.write_calibration(calibration)
    assert bus.is_calibrated(calibration)
    with open(file, "w") as out:
        json.dump(calibration, out, indent=4)
    print("calibrated")


def start_at(bus, ticks):
    """An arm without torque has fallen meanwhile: it goes to where the motion begins."""
    bus.sync_write("Goal_Position", ticks)
    time.sleep(2)


def teleoperate(leader_port, follower_port, file, record, seconds, cameras=None):
    with open(file) as text:
        calibration = json.load(text)
    leader, follower = Bus(leader_port), Bus(follower_port)
    for bus in (leader, follower):
        bus.connect()
        bus.configure()
        if not bus.is_calibrated(calibration):
            raise SystemExit("the registers are not those of the file")
    follower.set_torque(True)
    start_at(follower, to_ticks(calibration, to_degrees(calibration, leader.sync_read("Present_Position"))))
    feed = Cameras(cameras) if cameras else None
    frames, pictures, ticker = [], set(), Ticker()
    for _ in range(int(float(seconds) * FRAMES_PER_SECOND)):
        observation = to_degrees(calibration, follower.sync_read("Present_Position"))
        if feed:
            message = feed.latest()
            assert sorted(message["images"]) == ["front", "wrist"], list(message["images"])
            assert all(base64.b64decode(one)[:2] == b"\xff\xd8" for one in message["images"].values())
            pictures.add(message["timestamps"]["wrist"])
        action = to_degrees(calibration, leader.sync_read("Present_Position"))
        follower.sync_write("Goal_Position", to_ticks(calibration, action))
        frames.append({"action": action, "observation": observation})
        ticker.wait()
    time.sleep(0.5)
    rest, goal = to_degrees(calibration, follower.sync_read("Present_Position")), frames[-1]["action"]
    with open(record, "w") as out:
        json.dump(frames, out)
    travel = max(max(f["action"][m] for f in frames) - min(f["action"][m] for f in frames) for m in MOTORS)
    print(f"frames {len(frames)} late {ticker.late} repeated {leader.repeated + follower.repeated} pictures {len(pictures)} travel {travel:.1f} "
          f"apart {max(abs(rest[m] - goal[m]) for m in MOTORS):.2f}")


def replay(port, file, record):
    with open(file) as text, open(record) as recorded:
        calibration, frames = json.load(text), json.load(recorded)
    bus = Bus(port)
    bus.connect()
    assert bus.is_calibrated(calibration)
    bus.configure()
    bus.set_torque(True)
    start_at(bus, to_ticks(calibration, frames[0]["action"]))
    observations, ticker = [], Ticker()
    for frame in frames:
        observations.append(to_degrees(calibration, bus.sync_read("Present_Position")))
        bus.sync_write("Goal_Position", to_ticks(calibration, frame["action"]))
        ticker.wait()
    same, worst = 0, 0
    for i, frame in enumerate(frames):
        near = observations[max(0, i - NEAR):i + NEAR + 1]  # a busy machine delays both runs, each in its own way
        for motor in MOTORS:
            values, recorded = [one[motor] for one in near], frame["observation"][motor]
            same = max(same, abs(observations[i][motor] - recorded))
            worst = max(worst, min(values) - recorded, recorded - max(values))
    last = max(abs(observations[-1][motor] - frames[-1]["observation"][motor]) for motor in MOTORS)
    print(f"frames {len(frames)} late {ticker.late} largest {worst:.2f} same_frame {same:.2f} last {last:.2f}")


if __name__ == "__main__":
    {"calibrate": calibrate, "teleoperate": teleoperate, "replay": replay}[sys.argv[1]](*sys.argv[2:])
