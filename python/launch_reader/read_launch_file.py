"""python3 read_launch_file.py FILE [NAME:=VALUE ...]: reads a launch file and delivers its records."""

import os
import sys
import traceback

from doppel_launch.host import HOST
from doppel_launch.record import RECORDER, LaunchError, place_of_error
from doppel_launch.unknown import PackageFinder


def _result(error=None):
    out = {"files": RECORDER.files, "arguments": list(RECORDER.arguments.values()), "actions": RECORDER.actions,
           "warnings": RECORDER.warnings, "made": {k[5:]: v["source"] for k, v in RECORDER.descriptions.items()
                                                   if k.startswith("made:")}}
    if error is not None:
        out["error"] = error
    return out


def _number(records, count):
    """Each record gets a number, so that one can refer to another."""
    for record in records:
        count += 1
        record["id"] = count
        count = _number(record.get("children", []), count)
    return count


def _link(records):
    for record in records:
        if "after" in record:
            record["after"] = [one["id"] for one in record["after"] if "id" in one]
        _link(record.get("children", []))


def read(path, words):
    """The result of one file."""
    from launch import LaunchContext
    from launch.launch_description_sources import visit_file

    context = LaunchContext(argv=words)
    for word in words:
        name, _, value = word.partition(":=")
        context.launch_configurations[name] = value
    error = None
    try:
        visit_file(path, context, 0)
    except LaunchError as found:
        error = {"text": str(found), "file": found.place[0], "line": found.place[1], "fix": found.fix}
    except RecursionError:
        error = {"text": "its includes are in a circle, or nested too deeply", "file": path, "line": 1, "fix": ""}
    except Exception as found:  # whatever a launch file throws while it is visited
        place = place_of_error(found)
        if not place[0]:
            traceback.print_exc()
        error = {"text": f"{type(found).__name__}: {found}", "file": place[0] or path, "line": place[1] or 1, "fix": ""}
    _number(RECORDER.actions, 0)
    _link(RECORDER.actions)
    return _result(error)


# What every shell with ROS has; launch files read them without asking whether they exist.
VARIABLES = {"AMENT_PREFIX_PATH": "", "LD_LIBRARY_PATH": "", "ROS_DISTRO": "jazzy", "ROS_VERSION": "2",
             "GAZEBO_MODEL_PATH": "", "GAZEBO_RESOURCE_PATH": "", "GZ_SIM_RESOURCE_PATH": "", "PYTHONPATH": ""}


def main():
    for name, value in VARIABLES.items():
        os.environ.setdefault(name, value)
    sys.meta_path.append(PackageFinder())
    # The output of launch files belongs to a person, not to the pipe.
    sys.stdout = sys.stderr
    path, *words = sys.argv[1:]
    sys.argv = [path, *words]
    HOST.deliver(read(path, words))


if __name__ == "__main__":
    main()
