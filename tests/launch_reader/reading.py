"""Reads launch files in a worker (worker.py), answers what the reader asks for as doppel does, and judges the result.

A reading has to end with records or with a refusal in the reader's own form: a text of its own at a line of a file that it read.
What doppel's program takes apart (src/doppel/scenario/launch/launch_json.cpp) must have the types that it expects there.
"""
import json
import math
import os
import pathlib
import re
import selectors
import subprocess
import time

HERE = pathlib.Path(__file__).resolve().parent
MAX_TIME = 10            # s of the processor for one file, kMaxProcessorTime of confinement.cpp
MAX_MEMORY = 768 << 20   # bytes; the limit of the confined reader, 4 GiB, ends it without a reason
MAX_SILENCE = 15         # s in which the reader waits for something that does not come, such as the other end of a pipe
MAX_LINE = 256 << 20     # bytes, kMaxLine of launch_reader.cpp
MAX_TEXT = 4500          # characters of a message and how to repair it
MAX_VALUES, MAX_LEVELS = 1_000_000, 1000  # of bounded_json() in launch_json.cpp

# An exception that is reported by its class was not foreseen by the reader.
UNFORESEEN = re.compile(r"[A-Z]\w*(Error|Exception|Exit|Interrupt|Iteration|Warning): ")
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


class Worker:
    """One process that reads launch files one after another."""

    def __init__(self, root, mode, world):
        self.mode, self.world = mode, world
        request, self._requests_end = os.pipe()
        self._answers_end, answer = os.pipe()
        python = "/usr/bin/python3" if os.access("/usr/bin/python3", os.X_OK) else "python3"  # as launch_reader.cpp chooses it
        # The reader takes frames of other files for those of a launch file in Python, but not those without a file.
        start = f"exec(compile(open({str(HERE / 'worker.py')!r}).read(), '<worker>', 'exec'))"
        self.process = subprocess.Popen(
            [python, "-B", "-c", start, root / "python/launch_reader", mode, world.folder],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=world.folder,
            pass_fds=(self._requests_end, self._answers_end),
            env={"PATH": os.environ["PATH"], "DOPPEL_LAUNCH_PIPES": f"{self._requests_end},{self._answers_end}",
                 "DOPPEL_LAUNCH_FOLDER": str(world.folder / "made"), "TMPDIR": str(world.folder / "temporary")})
        os.close(self._requests_end)
        os.close(self._answers_end)
        self._requests, self._answers = request, answer
        self._selector = selectors.DefaultSelector()
        self._texts = {}
        for name, end in (("requests", request), ("report", self.process.stdout.fileno()), ("errors", self.process.stderr.fileno())):
            os.set_blocking(end, False)
            self._selector.register(end, selectors.EVENT_READ, name)
            self._texts[name] = bytearray()

    def end(self):
        self.process.kill()
        self.process.wait()
        self._selector.close()
        for end in (self._requests, self._answers):
            os.close(end)
        for file in (self.process.stdin, self.process.stdout, self.process.stderr):
            file.close()

    def read(self, path):
        """What became of one file, as a Reading."""
        out = Reading(path, self.mode)
        self.process.stdin.write(f"{path}\n".encode())
        self.process.stdin.flush()
        heard, (_, used) = time.monotonic(), self._state()
        while out.report is None and not out.faults:
            ready = self._selector.select(0.5)
            for key, _ in ready:
                self._take(key, out)
            state, now = self._state()
            # A process that is stopped, or waits for a processor of a busy machine, waits for nothing that a launch file names.
            if ready or state not in "SD":
                heard = time.monotonic()
            if now > used + MAX_TIME + 1:
                out.faults.append(f"time: it has not ended after {now - used:.1f} s of the processor")
            elif time.monotonic() > heard + MAX_SILENCE:
                out.faults.append(f"waits: it has not ended, and waits for {MAX_SILENCE} s")
        return out

    def _take(self, key, out):
        data = os.read(key.fd, 1 << 20)
        held = self._texts[key.data]
        searched = len(held)  # a line can be long
        held += data
        if not data:
            code = self.process.wait()
            out.errors = self._texts["errors"].decode(errors="replace")
            out.faults.append(f"ended: the reader's process has ended with {code}: {out.errors[-300:]}")
            return
        if len(held) > MAX_LINE:
            out.faults.append("line: the records are larger than what doppel reads")
        while key.data != "errors" and (end := held.find(b"\n", searched)) >= 0 and not out.faults:
            line = bytes(held[:end])
            del held[:end + 1]
            searched = 0
            if key.data == "report":
                self._finish(line, out)
            else:
                self._answer(line, out)

    def _finish(self, line, out):
        # The report follows what was asked and printed, which may still be in its pipe.
        for key, _ in self._selector.select(0):
            if key.data != "report":
                self._take(key, out)
        out.report = json.loads(line)
        out.errors = self._texts["errors"].decode(errors="replace")
        self._texts["errors"].clear()

    def _answer(self, line, out):
        request = strict_json(line, out)
        if not isinstance(request, dict):
            return
        if "result" in request:
            out.results.append(request["result"])
            out.line = line
            return
        out.requests.append(request)
        text = json.dumps(self.world.answer(request, self.mode)) + "\n"
        os.write(self._answers, text.encode())

    def _state(self):
        """The letter of the process's state, and the processor time that it has used, in s."""
        try:
            with open(f"/proc/{self.process.pid}/stat", encoding="ascii", errors="replace") as stat:
                fields = stat.read().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            return "X", 0
        return fields[0], (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Reading:
    """What a reader has delivered for one file, and the faults of it: each begins with its kind and a colon."""

    def __init__(self, path, mode):
        self.path, self.mode = path, mode
        self.results, self.requests, self.faults = [], [], []
        self.report, self.errors, self.line = None, "", b""

    @property
    def result(self):
        return self.results[0] if self.results else {}

    @property
    def error(self):
        return self.result.get("error")

    @property
    def refusal(self):
        """The message as doppel prints it; empty: it was read."""
        error = self.error
        return f"{os.path.basename(error['file'])}:{error['line']}: {error['text']}" if error else ""

    def judge(self, world):
        """Adds what is wrong with it to the faults, and returns them."""
        if self.report is None:
            return self.faults
        if "Traceback (most recent call last)" in self.errors:
            self.faults.append("traceback: " + " | ".join(self.errors.strip().splitlines()[-3:]))
        if self.report["ended"] or len(self.results) != 1:
            self.faults.append(f"ended: {len(self.results)} results, and {self.report['ended'] or 'no exception'}")
        if self.report["time"] > MAX_TIME:
            self.faults.append(f"time: {self.report['time']:.1f} s of the processor")
        if self.report["memory"] > MAX_MEMORY:
            self.faults.append(f"memory: {self.report['memory'] >> 20} MB")
        self.faults += [f"effect: {one}" for one in self.report["effects"]]
        self.faults += world.changes()
        shown = self.line.decode() + self.errors + json.dumps(self.requests)
        self.faults += [f"leak: the content of {name} is in the answer" for name, text in world.secrets.items() if text in shown]
        if self.results:
            Judge(self, world).judge()
        return self.faults


def strict_json(line, out):
    """The value of a line, if the program's parser would read it: no NaN, no lone half of a character, no endless number."""
    def refuse(name):
        raise ValueError(f"{name} is no number of JSON")

    counts = [0]
    try:
        text = line.decode("utf-8")
        value = json.loads(text, parse_constant=refuse, parse_float=finite, parse_int=finite)
        if SURROGATE.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
        check_extent(value, 0, counts)
    except (ValueError, OverflowError, RecursionError) as error:
        out.faults.append(f"json: doppel cannot read the line: {type(error).__name__}: {error!s:.200}")
        return None
    return value


def finite(text):
    if not math.isfinite(float(text)):
        raise ValueError(f"a number of {len(text)} digits is beyond a double")
    return int(text) if len(text) < 20 and text.lstrip("-").isdigit() else float(text)


def check_extent(value, level, counts):
    """Counts values as the callback of bounded_json() does: keys, both ends of lists and of mappings, and all others."""
    if isinstance(value, dict):
        counts[0] += 2 + len(value)
    else:
        counts[0] += 2 if isinstance(value, list) else 1
    if counts[0] > MAX_VALUES or level > MAX_LEVELS:
        raise ValueError("it has more values or levels than doppel reads")
    if isinstance(value, (dict, list)):
        for one in value.values() if isinstance(value, dict) else value:
            check_extent(one, level + 1, counts)


class Judge:
    """Checks one result: its places, its texts, and the types that launch_json.cpp expects."""

    def __init__(self, reading, world):
        self.reading, self.world, self.result = reading, world, reading.result
        self._lines = {}

    def fault(self, kind, text):
        self.reading.faults.append(f"{kind}: {text!s:.300}")

    def judge(self):
        try:
            self._judge_result()
        except (KeyError, TypeError, AttributeError) as error:
            self.fault("form", f"the result has another form: {type(error).__name__}: {error}")
        error = self.reading.error
        if error is None:
            return
        self._texts(error, "the error", "kind", "text", "file", "fix")
        if UNFORESEEN.match(error["text"]):
            self.fault("unforeseen", f"{error['text']} (in {error['file']}:{error['line']})")
        self._message(error, "the error")
        self._place(error, "the error")
        if not error["file"]:
            self.fault("place", f"an error without a place: {error['text']}")

    def _judge_result(self):
        for file in self.result["files"]:
            self._text(file, "a file")
        for one in self.result["arguments"]:
            self._texts(one, "an argument", "name", "default", "description", "value", "file")
            self._list_of_texts(one["choices"], "the choices")
            self._place(one, "an argument")
        for one in self.result["packages"]:
            self._texts(one, "a package", "package", "file")
            self._place(one, "a package")
        for one in self.result["expansions"]:
            self._texts(one, "an expansion", "path", "file", "call")
            self._pairs(one["arguments"], "an expansion")
            self._place(one, "an expansion")
        self._list_of_texts([*self.result["made"], *self.result["made"].values()], "a made file")
        for one in self.result["warnings"]:
            self._texts(one, "a warning", "rule", "file", "text", "fix")
            self._place(one, "a warning")
            if not one["rule"].startswith("launch.confined."):  # those have no text
                self._message(one, "a warning")
        for one in self.result["actions"]:
            self._record(one)

    def _record(self, one):
        self._texts(one, "a record", "kind", "package", "executable", "name", "namespace", "path", "cwd", "file", "plugin")
        self._place(one, f"a record {one.get('kind')}")
        for name in ("missing", "required", "ros1", "shell"):
            if not isinstance(one.get(name, False), bool):
                self.fault("type", f"'{name}' of a record is {one[name]!r}")
        if isinstance(one.get("period", 0), (bool, str, list)):
            self.fault("type", f"the period is {one['period']!r}")
        for name in ("words", "ros_arguments"):
            self._list_of_texts(one.get(name, []), name)
        for key in ("remappings", "environment", "arguments", "values"):
            values = one.get(key, [])
            self._pairs(list(values.items()) if isinstance(values, dict) else values, key)
        for part in one.get("parameters", []):
            self._text(part.get("path", ""), "a parameter file")
            for name, value in part.get("values", {}).items():
                self._parameter(name, value)
        if "value" in one:
            self._parameter(one.get("name", ""), one["value"])
        for child in (*one.get("children", []), *one.get("components", [])):
            self._record(child)

    def _parameter(self, name, value):
        """robot_text(): a mapping with both keys is taken for a description of the reader."""
        if name.endswith("description") and isinstance(value, dict) and "text" in value and "source" in value:
            self._texts(value, "a description", "text", "source")
            self._pairs(value["arguments"], "a description")

    def _text(self, value, subject):
        if not isinstance(value, str):
            self.fault("type", f"{subject} is {value!r}")

    def _texts(self, record, subject, *names):
        for name in names:
            self._text(record.get(name, ""), f"'{name}' of {subject}")

    def _message(self, record, subject):
        text = record["text"] + record["fix"]
        if not record["text"] or len(text) > MAX_TEXT or CONTROL.search(text):
            self.fault("text", f"{subject} has no text that can be shown, of {len(text)} characters: {text:.80}")

    def _list_of_texts(self, values, subject):
        for one in values if isinstance(values, list) else [values]:
            self._text(one, subject)

    def _pairs(self, values, subject):
        for one in values:
            if len(one) != 2 or not all(isinstance(part, str) for part in one):
                self.fault("type", f"{subject} has {one!r}")

    def _place(self, record, subject):
        """A place is a line of a file that was read."""
        file, line = record.get("file", ""), record.get("line", 0)
        if not file or not isinstance(line, int):
            self.fault("place", f"{subject} has the place {file!r}:{line!r}")
        elif file not in self.result["files"]:
            self.fault("place", f"{subject} has a place in {file}, which was not read")
        elif not 1 <= line <= self._count(file):
            self.fault("place", f"{subject} has the line {line}, of {self._count(file)} of {file}")

    def _count(self, file):
        if file not in self._lines:
            path = pathlib.Path(file)
            data = path.read_bytes() if path.is_file() else b""
            # A file that ends with a line break has an empty line, where something may be missing.
            self._lines[file] = len(re.findall(rb"\r\n|\r|\n|\xc2\x85|\xe2\x80[\xa8\xa9]", data)) + 1
        return self._lines[file]
