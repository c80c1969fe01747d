"""Runs doppel on every robot description below a folder of repositories, and prints a table.

  tools/sweep robots FOLDER [FOLDER ...]      # each folder directly below FOLDER is a family of robots
  tools/sweep robots ~/robots --save after.json --before before.json
  tools/sweep robots ~/robots --only 'franka|ur_' --list refused,moved
  tools/sweep robots ~/robots --engine bullet --before mujoco.json --list refused,diverged

A robot is a file with a <robot> element that is complete: a .urdf, or a xacro file that expands without arguments
to at least two links. Robots that expand to the same text count once. For each one:

  expanded   doppel xacro
  accepted   check_urdf (package liburdfdom-tools); if it is not installed, no error of the rules urdf.* and joint.*
  checked    doppel check ends with a report (exit code 0 or 1), within the time limit
  came up    doppel up runs for 0.5 s of simulated time
  at rest    then no joint is faster than 0.1 rad/s (m/s), or further than 0.01 beyond its limits in the description

--engine NAME brings them up in that physics engine; compare engines by --save of one run and --before of the other.
--emulate PROTOCOL gives every joint a servo on an emulated bus; the drivers hold the robot instead of the simulated hardware.
--every N takes every Nth file only.
--before FILE prints the figures of an earlier run (--save) next to those of this one.
--list KINDS prints the robots that a figure counts: unexpanded, unaccepted, unchecked, refused, diverged, moved, errors.
"""
import collections
import concurrent.futures
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

from sweeps import common
from sweeps.common import first_error

SKIPPED = {".git", "build", "install", "log", "node_modules"}
SPEED_AT_REST = 0.1  # rad/s or m/s
BEYOND_LIMIT = 0.01  # rad or m
KINDS = ("unexpanded", "unaccepted", "unchecked", "refused", "diverged", "moved", "errors")


def add_arguments(parser):
    common.add_arguments(parser)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--before", type=pathlib.Path, metavar="FILE", help="the saved results of an earlier run")
    parser.add_argument("--load", type=pathlib.Path, metavar="FILE", help="print a saved run instead of a new one")
    parser.add_argument("--engine", help="the physics engine (default: doppel's default)")
    parser.add_argument("--emulate", choices=("feetech", "dynamixel", "servo_line"), help="servos on an emulated bus")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only every Nth file")
    parser.add_argument("--list", default="", help="comma-separated: " + ", ".join(KINDS))
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds for each command")


def candidates(folder):
    """Files with a <robot> element that is not empty, in a stable order."""
    for path, folders, files in os.walk(folder):
        folders[:] = sorted(f for f in folders if f not in SKIPPED)
        for name in sorted(files):
            if not name.endswith((".urdf", ".xacro")):
                continue
            file = pathlib.Path(path, name)
            text = file.read_text(encoding="utf-8", errors="replace")
            head = re.search(r"<robot\b[^>]*>", text)
            stands_alone = head and ("<link" in text if name.endswith(".urdf") else re.search(r"\sname\s*=", head.group()))
            if stands_alone:
                yield file


def ask(options, *words):
    return common.run([options.program, *words], options.timeout, common.environment())


def number(element, name):
    try:
        return float(element.get(name))
    except (TypeError, ValueError):
        return None


def limits(urdf):
    """joint -> (lower, upper) of joints with a range, read independently of doppel."""
    found = {}
    for joint in ElementTree.fromstring(urdf).iter("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic"):
            continue
        low, high = number(limit, "lower"), number(limit, "upper")
        low, high = (0.0 if low is None else low), (0.0 if high is None else high)
        if low < high:
            found[joint.get("name")] = (low, high)
    return found


def unrest(joints, ranges):
    """Describes the joints that move or are beyond their limits."""
    out = []
    for name, joint in joints.items():
        q, v = joint.get("q"), joint.get("v")
        if q is None or v is None or not math.isfinite(q) or abs(v) > SPEED_AT_REST:
            out.append(f"{name} moves at {v:.3g}" if v is not None else f"{name} is not a number")
        low, high = ranges.get(name, (-math.inf, math.inf))
        if q is not None and not low - BEYOND_LIMIT <= q <= high + BEYOND_LIMIT:
            out.append(f"{name} is at {q:.3g}, outside [{low:.3g}, {high:.3g}]")
    return out


def accepted(file, options, checker, errors):
    if checker:
        code, out, err = common.run([checker, file], options.timeout, common.environment())
        return code == 0, "" if code == 0 else first_error(err or out)
    rejected = [rule for rule in errors if rule.startswith(("urdf.", "joint."))]
    return not rejected, ", ".join(rejected)


def expand(file, options, folder):
    """The expansion as a file, or None; its links are counted by the caller."""
    code, out, err = ask(options, "xacro", file)
    if code != 0:
        return None, first_error(err)
    path = folder / (hashlib.sha1(str(file).encode()).hexdigest() + ".urdf")
    path.write_text(out, encoding="utf-8")
    return path, ""


def try_check(file, options, result):
    code, out, err = ask(options, "check", "--json", file)
    result["checked"] = code in (0, 1)
    if not result["checked"]:
        result["check_message"] = first_error(err)
        return
    findings = json.loads(out).get("findings", [])
    result["errors"] = dict(collections.Counter(f["rule"] for f in findings if f["severity"] == "error"))


def try_up(file, urdf, options, result):
    code, out, err = ask(options, "up", file, "--headless", "--json", "--no-ros", "--no-reload", "--speed", "max",
                         "--duration", "0.501", *(["--engine", options.engine] if options.engine else []),
                         *(["--emulate", "--protocol", options.emulate] if options.emulate else []))
    result["up_exit"] = code
    if code not in (0, 1) or not out.strip():
        result["up"] = "refused"
        result["up_message"] = first_error(err)
        return
    summary = json.loads(out)
    if summary["end"] == "diverged":
        result["up"], result["up_message"] = "diverged", first_error(err)
        return
    result["up"] = "came up"
    result["unrest"] = unrest(summary["joints"], limits(urdf))
    if not result["unrest"] and not (summary.get("rest") or {}).get("joints_at_rest", True):
        result["unrest"] = summary["rest"]["complaints"]


def attempt(family, file, options, folder, checker, seen):
    result = {"family": family, "file": str(file)}
    expansion, why = expand(file, options, folder)
    result["expanded"] = expansion is not None
    if expansion is None:
        result["xacro_message"] = why
        return result
    urdf = expansion.read_text(encoding="utf-8")
    try:
        links = sum(1 for _ in ElementTree.fromstring(urdf).iter("link"))
    except ElementTree.ParseError as error:
        result["xacro_message"], result["expanded"] = str(error), False
        return result
    digest = hashlib.sha1(re.sub(r"<!--.*?-->|\s+", "", urdf, flags=re.S).encode()).hexdigest()
    if links < 2 or seen.setdefault(digest, file) != file:
        return None  # a part without joints, or a robot that was counted
    result["links"] = links
    try_check(file, options, result)
    result["accepted"], result["accept_message"] = accepted(expansion, options, checker, result.get("errors", {}))
    try_up(file, urdf, options, result)
    return result


def sweep(options):
    checker = shutil.which("check_urdf")
    work = []
    for folder in options.folders:
        for family in sorted(f for f in folder.iterdir() if f.is_dir()):
            work += [(family.name, f) for f in candidates(family) if re.search(options.only, str(f))]
    work = work[::options.every]
    results, seen = [], {}
    with tempfile.TemporaryDirectory() as scratch, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        pending = [pool.submit(attempt, family, file, options, pathlib.Path(scratch), checker, seen) for family, file in work]
        for done, future in enumerate(pending, 1):
            if (result := future.result()) is not None:
                results.append(result)
            if sys.stderr.isatty() or done % 100 == 0:
                print(f"\rsweep: {done} of {len(work)} files, {len(results)} robots", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return results


def of_kind(kind, r):
    ran = r.get("accepted")
    return {"unexpanded": not r["expanded"], "unaccepted": r["expanded"] and not ran,
            "unchecked": ran and not r["checked"], "refused": ran and r["up"] == "refused",
            "diverged": ran and r["up"] == "diverged", "moved": ran and bool(r.get("unrest")),
            "errors": ran and bool(r.get("errors"))}[kind]


def figures(results):
    count = lambda test: sum(1 for r in results if test(r))
    return {"robots": len(results), "expanded": count(lambda r: r["expanded"]),
            "accepted": count(lambda r: r.get("accepted")),
            "checked": count(lambda r: r.get("accepted") and r["checked"]),
            "came up": count(lambda r: r.get("accepted") and r["up"] == "came up"),
            "refused": count(lambda r: of_kind("refused", r)), "diverged": count(lambda r: of_kind("diverged", r)),
            "at rest": count(lambda r: r.get("accepted") and r["up"] == "came up" and not r["unrest"]),
            "no errors": count(lambda r: r.get("accepted") and r["checked"] and not r["errors"])}


def table(results, before):
    """One row for each family; `before -> now` where the two differ."""
    families = sorted({r["family"] for r in results} | {r["family"] for r in before})
    head = list(figures([]))
    rows = []
    for family in families + [None]:
        now = figures([r for r in results if family in (r["family"], None)])
        old = figures([r for r in before if family in (r["family"], None)]) if before else now
        rows.append([family or "all"] + [str(now[h]) if now[h] == old[h] else f"{old[h]} -> {now[h]}" for h in head])
    widths = [max(len(row[i]) for row in [["family"] + head] + rows) for i in range(len(head) + 1)]
    for row in [["family"] + head] + rows:
        print("  ".join(row[0:1][0].ljust(widths[0]) if i == 0 else cell.rjust(widths[i]) for i, cell in enumerate(row)))
    total = figures(results)
    if total["accepted"]:
        print(f"\nof {total['accepted']} robots that check_urdf accepts, {100 * total['came up'] / total['accepted']:.1f} % came up, "
              f"{100 * total['at rest'] / total['accepted']:.1f} % came up and are at rest after 0.5 s")


def print_lists(results, kinds):
    for kind in kinds:
        print(f"\n{kind}:")
        for r in results:
            if not of_kind(kind, r):
                continue
            why = {"unexpanded": r.get("xacro_message"), "unaccepted": r.get("accept_message"),
                   "unchecked": r.get("check_message"), "moved": "; ".join(r.get("unrest") or []),
                   "errors": ", ".join(f"{k} x{n}" for k, n in (r.get("errors") or {}).items())}.get(kind, r.get("up_message"))
            print(f"  {r['file']}\n      {why}")


def run(options):
    kinds = [k for k in options.list.split(",") if k]
    if wrong := [k for k in kinds if k not in KINDS]:
        print(f"tools/sweep: --list accepts {', '.join(KINDS)}; got {', '.join(wrong)}", file=sys.stderr)
        return 2
    results = json.loads(options.load.read_text()) if options.load else sweep(options)
    if options.save:
        options.save.write_text(json.dumps(results, indent=1))
    table(results, json.loads(options.before.read_text()) if options.before else [])
    print_lists(results, kinds)
    return 0
