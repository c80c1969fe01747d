"""Starts every launch file below a folder of repositories, and prints a table.

  tools/sweep launch FOLDER                       # each folder directly below FOLDER is a repository
  tools/sweep launch ~/repositories --save after.json --list refused,missed
  tools/sweep launch ~/repositories --only 'ur_|panda' --every 3

Each file runs for half a second of simulated time, without the user's own programs and without arguments. A file ends as

  came up     a robot moves or is shown, with the controllers that the file starts
  no robot    it starts none: a tool, a planner
  part        it starts controllers or a spawner, for a description that another file loads
  arguments   it has arguments without a default, or is a part that needs those of the file that includes it
  packages    the robot's description, or a file that it includes, is in a package that is not below FOLDER
  broken      files of its repository do not exist or are not well-formed, or it asks a person: ROS refuses it, too
  missed      it names a robot's description, and doppel found no robot
  refused     doppel cannot read it, or cannot start the robot

"of those that start a robot" leaves out the second to sixth kind.
--list KINDS prints the files of some kinds with the first error.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import re

from sweeps import common
from sweeps.common import first_error

SKIPPED = {".git", "build", "install", "log", "node_modules", "test", "tests"}
KINDS = ("came up", "no robot", "part", "arguments", "packages", "broken", "missed", "refused")
# Variables that launch files of these repositories read without a default; their users set them in .bashrc.
VARIABLES = {"TURTLEBOT3_MODEL": "waffle_pi", "LINOROBOT2_BASE": "2wd", "LINOBASE": "2wd", "LINOLIDAR": "ydlidar", "LDS_MODEL": "LDS-01",
             "KATANA_TYPE": "katana_300_6m180", "ROBOT": "pr2", "HELLO_FLEET_PATH": "/tmp", "HELLO_FLEET_ID": "stretch", "USER": "user",
             "PR2_SIMULATOR": "1", "JACKAL_LASER": "0", "HUSKY_LMS1XX_ENABLED": "0"}
ROBOT = re.compile(r"robot_state_publisher|spawn_entity|spawn_model|ros2_control_node|executable=.create.")
# Where ROS refuses, too: files of the repository itself that do not exist or are not well-formed, and errors that the launch file throws.
BROKEN = re.compile(r"cannot be read: No such file|No such file or directory|not well-formed|this is not XML|is neither a bundled robot nor a file|"
                    r"yaml.nested_list|the file '[^']*' does not exist|error: (AssertionError|FileNotFoundError|KeyError|EOFError|ValueError)|"
                    r"launch.unreadable|without 'exec'|without 'type'|SyntaxError|TypeError: join|xacro without a file|xacro.undefined")


def add_arguments(parser):
    common.add_arguments(parser)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only every Nth file")
    parser.add_argument("--most", type=int, default=0, metavar="N", help="at most N files of a repository, evenly chosen")
    parser.add_argument("--list", default="", help="comma-separated: " + ", ".join(KINDS))
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for each file")


def is_launch_file(path):
    name = path.name
    if name.endswith(".py"):
        named = re.search(r"[_.]launch\.py$", name) or path.parent.name == "launch"
        return bool(named) and "generate_launch_description" in path.read_text(encoding="utf-8", errors="replace")
    return bool(re.search(r"\.launch(\.xml|\.ya?ml)?$", name))


def launch_files(folder):
    for path, folders, files in os.walk(folder):
        folders[:] = sorted(f for f in folders if f not in SKIPPED)
        for name in sorted(files):
            file = pathlib.Path(path, name)
            if is_launch_file(file):
                yield file


def chosen(options):
    """The files to start, by --only, --most and --every."""
    by_repository, seen = collections.defaultdict(list), set()
    for file in launch_files(options.folder):
        content = file.read_bytes() if file.is_file() else b""
        if content and content not in seen and re.search(options.only, str(file)):
            seen.add(content)
            by_repository[file.relative_to(options.folder).parts[0]].append(file)
    files = []
    for _, own in sorted(by_repository.items()):
        count = min(options.most or len(own), len(own))
        files += [own[i * len(own) // count] for i in range(count)]
    return files[::options.every]


def kind_of(code, errors, file):
    if code == 0:
        return "came up"
    if "launch.no_description" in errors and "[launch.include]" not in errors:
        return "part"
    if "launch.no_robot" in errors or "launch.no_description" in errors:
        if "[launch.include]" in errors:
            return "packages"
        return "missed" if ROBOT.search(file.read_text(encoding="utf-8", errors="replace")) else "no robot"
    if re.search(r"is required, and has no default|launch configuration '[^']*' does not exist|the argument '[^']*' does not exist|the argument '[^']*' is '|"
                 r"environment variable '[^']*' is not set|error: KeyError: '[A-Z_0-9]+'", errors):
        return "arguments"
    if re.search(r"launch.unknown_module|/absent/|package '[^']+' (is not|not) |xacro.package|package_not_found|no package", errors):
        return "packages"
    return broken_or_refused(errors, file)


def broken_or_refused(errors, file):
    """A missing file of another repository is a package of another version."""
    if not BROKEN.search(errors):
        return "refused"
    missing = re.search(r"'(/[^']*)' cannot be read|No such file or directory: '(/[^']*)'", errors)
    path = next(filter(None, missing.groups()), "") if missing else ""
    own = repository_of(file)
    return "packages" if path.startswith(str(own.parent)) and not path.startswith(str(own) + "/") else "broken"


def repository_of(file):
    """The folder directly below that of the sweep."""
    return next(parent for parent in file.parents if parent.parent == SWEPT[0])


SWEPT = []  # the folder of the sweep


def error_of(errors):
    lines = [line for line in errors.splitlines() if re.search(r"(^|: )error: ", line)]
    return lines[-1].strip() if lines else first_error(errors)


def robot_of(output):
    try:
        summary = json.loads(output)
    except ValueError:
        return {}
    return {"robot": summary.get("robot"), "joints": len(summary.get("joints", [])),
            "controllers": [f"{name} ({state})" for name, state in summary.get("controllers", {}).items()],
            "sim_time": summary.get("sim_time_s")}


def start(file, options, environment):
    command = [options.program, "launch", file, "--headless", "--duration", "0.5", "--speed", "max", "--no-programs", "--no-ros",
               "--no-open", "--black-box", "0", "--json"]
    code, output, errors = common.run(command, options.timeout, environment)
    result = {"file": str(file.relative_to(options.folder)), "kind": kind_of(code, errors, file), "code": code,
              "error": "" if code == 0 else error_of(errors), "repository": file.relative_to(options.folder).parts[0]}
    result.update(robot_of(output))
    if code == 0 and result.get("robot") is None:
        result["robot"] = errors.split(":", 2)[0] if "no physics" in errors else ""
        result["shown"] = True
    result["unknown"] = sorted(set(re.findall(r"the package '([^']+)' is not on this machine", errors)))
    return result


def print_table(results):
    by_repository = collections.defaultdict(collections.Counter)
    for one in results:
        by_repository[one["repository"]][one["kind"]] += 1
    width = max([len(name) for name in by_repository] + [10])
    print(f"{'repository':{width}}  " + "  ".join(f"{kind:>9}" for kind in KINDS))
    for name, counts in sorted(by_repository.items()):
        print(f"{name:{width}}  " + "  ".join(f"{counts[kind] or '':>9}" for kind in KINDS))
    total = collections.Counter(one["kind"] for one in results)
    print(f"{'all ' + str(len(results)):{width}}  " + "  ".join(f"{total[kind]:>9}" for kind in KINDS))
    starting = total["came up"] + total["missed"] + total["refused"]
    if starting:
        print(f"of those that start a robot {total['came up']} of {starting} do: {100 * total['came up'] / starting:.1f} %; "
              f"{len([1 for counts in by_repository.values() if counts['came up']])} repositories")


def run(options):
    options.folder = options.folder.absolute()
    SWEPT.append(options.folder)
    files = chosen(options)
    environment = {**VARIABLES, **common.environment(options.folder)}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda file: start(file, options, environment), files))
    if options.save:
        options.save.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print_table(results)
    for kind in filter(None, options.list.split(",")):
        print(f"\n{kind}:")
        for one in results:
            if one["kind"] == kind:
                print(f"  {one['file']}: {one['error'] or one.get('robot')}")
    return 0
