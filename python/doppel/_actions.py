"""Trajectories as goals of FollowJointTrajectory and messages as JSON, for Twin and Client."""
import json
import math
import os

from ._errors import ServiceError, refuse

SUCCEEDED = 4  # action_msgs/msg/GoalStatus


def plain(value):
    """NumPy's values for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be a field of a message")


def message_json(message):
    """A message as JSON, which has no NaN and no infinities: they become strings, which are accepted for numbers."""
    text = json.dumps(message, default=plain)
    if "NaN" in text or "Infinity" in text:
        text = json.dumps(json.loads(text, parse_constant={"NaN": "nan", "Infinity": "inf", "-Infinity": "-inf"}.get))
    return text


def send_goal(call, action, joints, times, positions, goal_id=None, reason=lambda: ""):
    """Sends a trajectory; returns the goal's id and the duration in s. Raises ServiceError if it is refused."""
    try:
        rows = [list(map(float, row)) for row in positions]
        times = list(map(float, times))
    except (TypeError, ValueError):
        refuse("python.numbers", "times and positions are not numbers", "pass times [n] in s and positions [n, joints] in rad or m")
    if not all(map(math.isfinite, times)):
        refuse("python.range", f"times are {times}; they must be finite", "pass times [n] in s from now")
    if not times or len(rows) != len(times) or any(len(row) != len(joints) for row in rows):
        refuse("python.shape", f"positions must have {len(times)} rows of {len(joints)} numbers", f"one for each of {', '.join(joints)}")
    points = []
    for time, row in zip(times, rows):
        seconds, nanoseconds = divmod(round(time * 1e9), 10**9)
        points.append(dict(positions=row, time_from_start=dict(sec=seconds, nanosec=nanoseconds)))
    goal_id = {"uuid": list(goal_id or os.urandom(16))}
    goal = {"trajectory": {"joint_names": joints, "points": points}}
    if not call(action + "/_action/send_goal", {"goal_id": goal_id, "goal": goal})["accepted"]:
        raise ServiceError(f"{action}: the goal was refused{reason()}")
    return goal_id, times[-1]


def read_result(action, answer):
    """The result of a goal that was reached; raises ServiceError with the reason for any other end."""
    if answer["status"] != SUCCEEDED:
        why = answer["result"].get("error_string") or f"it ended with status {answer['status']}"
        raise ServiceError(f"{action}: {why}")
    return answer["result"]
