"""python3 read_launch_file.py FILE [NAME:=VALUE ...]: reads a launch file and delivers its records.

`--survey FILE ...` delivers those of several files, with the branches that their conditions leave out.
"""

import os
import sys

from doppel_launch.host import HOST
from doppel_launch.record import RECORDER, error_record
from doppel_launch.unknown import PackageFinder


def _result(error=None):
    made = {k[5:]: v["source"] for k, v in RECORDER.descriptions.items() if k.startswith("made:")}
    out = {"files": RECORDER.files, "arguments": list(RECORDER.arguments.values()), "actions": RECORDER.actions,
           "warnings": RECORDER.warnings, "packages": RECORDER.packages, "expansions": RECORDER.expansions,
           "made": made}
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
        visit_file(path, context)
    except Exception as found:  # whatever a launch file throws while it is visited
        error = None if RECORDER.assumed else error_record(found, path)
    _number(RECORDER.actions, 0)
    _link(RECORDER.actions)
    return _result(error or RECORDER.error)


def survey(paths):
    """Delivers the result of each file, without letting it have an effect."""
    from doppel_launch import confined

    confined.install()
    RECORDER.survey = True
    folder, variables, modules = os.getcwd(), dict(os.environ), list(sys.path)
    for path in paths:
        RECORDER.__init__()
        RECORDER.path, sys.argv, sys.path[:] = path, [path], modules
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(variables)
        try:
            result = read(path, [])
        except SystemExit:
            result = _result({"kind": "SystemExit", "file": path, "line": 1})
        HOST.deliver(result)


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
    if path == "--survey":
        survey(words)
        return
    sys.argv = [path, *words]
    HOST.deliver(read(path, words))


if __name__ == "__main__":
    main()
