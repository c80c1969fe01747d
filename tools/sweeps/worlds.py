"""Reads and compiles every SDF world and model below folders, as `doppel world check` does, and prints a table.

    tools/sweep worlds FOLDER ... [--all] [--only PATTERN] [--save FILE]

One line for each file that is not accepted, with the first error (with --all also for the others), then the totals:
accepted, refused (exit code 2), failed (any other end, or longer than a minute). The folders of models that contain a
model.config are on the search path.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import statistics
import time

from sweeps import common

TIMEOUT = 60  # s


def files_below(folder):
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".sdf", ".world") and path.is_file():
            yield path


def check(program, file, environment):
    begin = time.monotonic()
    code, out, err = common.run([program, "world", "check", "--json", file], TIMEOUT, environment)
    seconds = time.monotonic() - begin
    if code == 0:
        return file, "accepted", seconds, json.loads(out)["findings"], ""
    return file, "refused" if code == 2 else "failed", seconds, [], common.first_error(err)


def add_arguments(parser):
    common.add_arguments(parser)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--all", action="store_true", help="print accepted files, too")


def run(options):
    environment = common.environment(*options.folders)
    files = [file for folder in options.folders for file in files_below(folder) if re.search(options.only, str(file))]
    ends, times, rules, saved = collections.Counter(), [], collections.Counter(), []
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for file, end, seconds, findings, why in pool.map(lambda f: check(options.program, f, environment), files):
            ends[end] += 1
            times.append(seconds)
            saved.append({"file": str(file), "end": end, "seconds": seconds, "why": why, "findings": findings})
            for rule in {(finding["severity"], finding["rule"]) for finding in findings}:
                rules[rule] += 1
            if end != "accepted" or options.all:
                print(f"{end:<9} {seconds:6.2f} s  {file}  {why}", flush=True)
    common.print_counts(f"{len(files)} files", ends)
    if times:
        print(f"time of a process: median {statistics.median(times):.3f} s, longest {max(times):.2f} s")
    for (severity, rule), count in rules.most_common():
        print(f"  {severity:<8} {rule:<24} in {count} files")
    if options.save:
        options.save.write_text(json.dumps(saved, indent=1), encoding="utf-8")
    return 0 if set(ends) <= {"accepted", "refused"} else 1
