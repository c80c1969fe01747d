"""Brings up the robots, models and worlds of a list, reads every topic of every sensor, and prints a table.

    tools/sweep sensors LIST FOLDER [--only PATTERN] [--world FILE] [--save FILE] [--verbose]

LIST has one a line: a file below FOLDER and name:=value arguments, as for `doppel up`; a file that ends in .sdf or .world is
brought up as a world. A line may begin with a name and a colon; # begins a comment. All packages below FOLDER are found
(ROS_PACKAGE_PATH). Each is one of

  reads      every sensor's topics brought a message, in a frame that is in TF
  wrong      a topic was silent, or in a frame that is not in TF
  none       came up, and has no sensor
  refused    exit code 2, with the first error
  failed     any other end

and of each how many sensors of each type, and the notes about sensors that are not simulated. --verbose prints what came.
"""
import collections
import json
import pathlib
import subprocess
import tempfile
import time

from sweeps import common

START = 60  # s
READ = 90  # s


def come_up(command, log, environment):
    """The process, when its server is ready or it has ended."""
    process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)
    end = time.monotonic() + START
    while process.poll() is None and time.monotonic() < end:
        if "ready " in pathlib.Path(log.name).read_text(errors="replace"):
            break
        time.sleep(0.1)
    return process


def sweep(options, words, port):
    file = options.folder / words[0]
    command = [options.program, "up"]
    command += ["--world", str(file)] if file.suffix in (".sdf", ".world") else [str(file)]
    command += words[1:] + ["--headless", "--no-ros", "--no-open", "--no-reload", "--port", str(port)]
    if options.world and file.suffix not in (".sdf", ".world"):
        command += ["--world", options.world]
    with tempfile.NamedTemporaryFile("w", prefix="sweep_sensors", encoding="utf-8") as log:
        log_path = pathlib.Path(log.name)
        process = come_up(command, log, options.environment)
        try:
            if process.poll() is not None:
                text = log_path.read_text(errors="replace")
                return "refused" if process.returncode == 2 else "failed", common.first_error(text), [], [], text
            ask = lambda verb: common.run([options.program, "sensor", verb, "--json", "--port", port], READ, options.environment)
            (code, listed, error), (_, checked, fault) = ask("list"), ask("check")
            text = log_path.read_text(errors="replace")
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
    if code != 0 or not checked:
        return "failed", (error or fault).strip(), [], [], text
    sensors, topics = json.loads(listed), json.loads(checked)
    faults = [f"{topic['topic']}: {topic['fault']}" for topic in topics if topic["fault"]]
    end = "none" if not sensors else "wrong" if faults else "reads"
    return end, "; ".join(faults), sensors, topics, text


def add_arguments(parser):
    common.add_arguments(parser)
    common.add_list(parser)
    parser.add_argument("--world", default="", help="world for the robots")
    parser.add_argument("--port", type=int, default=7950)
    parser.add_argument("--verbose", action="store_true", help="also the topics, their frames and content")


def run(options):
    options.environment = common.environment(options.folder)
    ends, kinds, saved = collections.Counter(), collections.Counter(), []
    for name, words in common.listed(options):
        end, why, sensors, topics, text = sweep(options, words, options.port)
        ends[end] += 1
        types = collections.Counter(sensor["type"] for sensor in sensors)
        kinds.update(types)
        print(f"{end:<8} {name:<28} {', '.join(f'{n} {kind}' for kind, n in sorted(types.items()))}  {why[:300]}",
              flush=True)
        notes = sorted({line.strip() for line in text.splitlines() if "sensor" in line and "not simulated" in line})
        for line in notes:
            print(f"         {line[:200]}")
        if options.verbose:
            for topic in topics:
                print(f"         {topic['topic']:<44} {topic['frame']:<28} {topic['content']}")
        saved.append({"name": name, "end": end, "why": why, "sensors": sensors, "topics": topics, "log": text})
    common.print_counts(f"{sum(ends.values())}", ends)
    common.print_counts("sensors", kinds)
    if options.save:
        options.save.write_text(json.dumps(saved, indent=1), encoding="utf-8")
    return 1 if ends["failed"] else 0
