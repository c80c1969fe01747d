"""Brings up the mobile robots of a list, lets each drive 1 m and turn by 90 degrees, and prints a table.

    tools/sweep bases LIST FOLDER [--only PATTERN] [--save FILE] [--verbose]

LIST has one robot a line, as for `doppel up`: its description below FOLDER, name:=value arguments, and --controllers with
a file below FOLDER where the description names none. A line may begin with a name and a colon; # begins a comment. All
packages below FOLDER are found (ROS_PACKAGE_PATH). Each robot is one of

  drives     stands on its wheels, has driven 1 m straight and turned by 90 degrees
  wrong      came up, but something is not as it should be, which follows
  no base    came up, and no controller reads velocities
  refused    exit code 2, with the first error
  failed     any other end, or longer than two minutes

and of one that drives, by what, and where its odometry says that it is after the metre, and after the turn. By: `yaml`, its
own controllers' file, which --verbose prints; `plugin`, a controller in place of its Gazebo plugin; `generated`, from its wheels.
"""
import collections
import concurrent.futures
import json
import math
import os

from sweeps import common

TIMEOUT = 120  # s
LOAD = 0.98  # least part of the weight on wheels and casters
TILT = 3.0  # degrees
CREEP = 0.002  # m in a second, without a command
STRAIGHT = 0.05  # m, and rad: deviation of 1 m
QUARTER = 8.0  # degrees: deviation of 90
SLIP = 10.0  # per cent of the metre, between odometry and truth


def arguments_of(words, folder):
    """The words with the files below the folder; a file whose path is not written exactly is looked up."""
    out = []
    for i, word in enumerate(words):
        out.append(str(folder / word) if i == 0 or words[i - 1] == "--controllers" else word)
    return out


def faults_of(report):
    if report["wheels"] < 2:
        yield f"{report['wheels']} wheels found"
    if report["load"] < LOAD:
        yield f"{100 * report['load']:.0f} % of the weight is on wheels and casters"
    if report["tilt_degrees"] > TILT:
        yield f"tilts by {report['tilt_degrees']:.1f} degrees"
    if report["creep"] > CREEP:
        yield f"creeps by {1e3 * report['creep']:.1f} mm in a second"
    straight, turn = report["straight"]["truth"], report["turn"]["truth"]
    if abs(straight["x"] - 1) > STRAIGHT or abs(straight["y"]) > STRAIGHT or abs(math.radians(straight["degrees"])) > STRAIGHT:
        yield f"1 m is ({straight['x']:.3f}, {straight['y']:.3f}) m, {straight['degrees']:.1f} degrees"
    if "odometry_topic" in report and abs(100 * (report["straight"]["odometry"]["x"] / straight["x"] - 1)) > SLIP:
        yield "its wheels slip or have another radius than its controller"
    if abs(turn["degrees"] - 90) > QUARTER:
        yield f"90 degrees are {turn['degrees']:.1f}"
    for found in report["diagnostics"]:
        if found["rule"] == "up.base_axis":
            yield "reported: " + found["message"]


def odometry_of(report):
    if "odometry_topic" not in report:
        return "no odometry"
    straight, turn = report["straight"], report["turn"]
    share = lambda part, key: 100 * (part["odometry"][key] / part["truth"][key] - 1) if part["truth"][key] else math.inf
    return f"odometry {share(straight, 'x'):+.2f} % of the metre, {share(turn, 'degrees'):+.1f} % of the turn"


def driven_by(report):
    origin = report.get("driven_by", "-")
    return "yaml" if "/" in origin else origin


def sweep(options, name, words, environment):
    code, out, err = common.run([options.program, *arguments_of(words, options.folder)], TIMEOUT, environment)
    if not out.startswith("{"):
        return name, "failed", err if code is None else f"exit code {code}: {err.strip()[-300:]}", {}
    report = json.loads(out)
    if code == 2:
        return name, "refused", report["refused"].splitlines()[0], report
    if "failed" in report:
        return name, "failed", report["failed"], report
    base = " ".join(sorted({c.split("/")[0] for c in report["controllers"] if "broadcaster" not in c}))
    what = f"{report['mass']:.1f} kg, {report['wheels']} wheels, {report['casters']} casters, {base or 'no controller'}"
    if "straight" not in report:
        return name, "no base", what, report
    faults = list(faults_of(report))
    return name, "wrong" if faults else "drives", "; ".join([*faults, what, odometry_of(report)]), report


def add_arguments(parser):
    common.add_arguments(parser, "bench_drive_base")
    common.add_list(parser)
    parser.add_argument("--verbose", action="store_true", help="also what each robot rolls on, and its log")


def run(options):
    options.folder = options.folder.resolve()
    environment = common.environment(options.folder)
    robots = list(common.listed(options))
    ends, kinds, reports = collections.Counter(), collections.Counter(), {}
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for name, end, what, report in pool.map(lambda robot: sweep(options, *robot, environment), robots):
            ends[end] += 1
            reports[name] = report
            kinds[driven_by(report)] += end == "drives"
            print(f"{end:<8} {driven_by(report):<9} {name:<22} {what}", flush=True)
            if options.verbose:
                for line in [report.get("driven_by", ""), report.get("rolling", ""), *report.get("log", [])]:
                    print(f"{'':31} {line}")
    common.print_counts(f"{len(robots)} robots", ends)
    common.print_counts("driven by", kinds)
    if options.save:
        options.save.write_text(json.dumps(reports, indent=1), encoding="utf-8")
    return 0 if set(ends) <= {"drives"} else 1
