"""What all sweeps share: lists of robots, search paths, one run of the program, the last line."""
import os
import pathlib
import re
import shlex
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
NO_ANSWER = "no answer"


def add_arguments(parser, program="doppel"):
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin" / program, help="default: build/bin/%s" % program)
    parser.add_argument("--only", default="", metavar="PATTERN", help="names or paths in which this regular expression is found")
    parser.add_argument("--save", type=pathlib.Path, metavar="FILE", help="write all results as JSON")


def add_list(parser):
    parser.add_argument("list", type=pathlib.Path, help="one a line, as for `doppel up`, with paths below FOLDER")
    parser.add_argument("folder", type=pathlib.Path)


def listed(options):
    """The names and words of the list's lines. A line may begin with a name and a colon; # begins a comment."""
    for line in options.list.read_text(encoding="utf-8").splitlines():
        line = line.split("#")[0].strip()
        if not line:
            continue
        name, colon, words = line.partition(": ")
        words = shlex.split(words if colon else line)
        name = name if colon else pathlib.Path(words[0]).stem.split(".")[0]
        if re.search(options.only, name):
            yield name, words


def environment(*folders):
    """The present one without ROS and Gazebo; packages and models below the folders are on the search paths."""
    out = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "AMENT_", "GZ_", "GAZEBO_"))}
    out.setdefault("DOPPEL_ROOT", str(ROOT))
    packages = {str(file.parent.parent.absolute()) for folder in folders for file in folder.rglob("package.xml")}
    models = {str(file.parent.parent.absolute()) for folder in folders for file in folder.rglob("model.config")}
    if packages:
        out["ROS_PACKAGE_PATH"] = ":".join(sorted(packages))
    if packages or models:
        out["GZ_SIM_RESOURCE_PATH"] = ":".join(sorted(models | packages))
    return out


def run(command, timeout, env):
    """Exit code, output and errors; after the time limit None, nothing and the reason."""
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, timeout=timeout, env=env, text=True,
                              errors="replace", stdin=subprocess.DEVNULL, check=False)
    except subprocess.TimeoutExpired:
        return None, "", f"{NO_ANSWER} within {timeout:g} s"
    return done.returncode, done.stdout, done.stderr


def first_error(text):
    lines = [line for line in text.splitlines() if "error" in line.lower()] or text.strip().splitlines() or ["no message"]
    return lines[0].strip()


def print_counts(what, counts):
    print(what + ": " + ", ".join(f"{count} {kind}" for kind, count in counts.most_common() if count))
