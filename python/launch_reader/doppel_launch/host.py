"""The program that runs the reader: it finds packages, expands xacro, and gets the result.

Each request is a line of JSON on one pipe, each answer a line on the other.
"""

import json
import os

from .record import RECORDER, LaunchError


class Host:
    """The two pipes. Without them (the reader is run by hand) packages are those of AMENT_PREFIX_PATH."""

    def __init__(self):
        requests, answers = os.environ.pop("DOPPEL_LAUNCH_PIPES", ",").split(",")
        # Half of a character, which Python and YAML permit, is no UTF-8, and the program rejects it.
        self._requests = os.fdopen(int(requests), "w", encoding="utf-8", errors="replace") if requests else None
        self._answers = os.fdopen(int(answers), "r", encoding="utf-8") if answers else None
        self._packages = {}
        self.folder = os.environ.pop("DOPPEL_LAUNCH_FOLDER", "")

    def _send(self, line):
        self._requests.write(json.dumps(line, ensure_ascii=False) + "\n")
        self._requests.flush()

    def _ask(self, request):
        if self._requests is None:
            return {}
        self._send(request)
        line = self._answers.readline()
        if not line:
            raise SystemExit(1)
        return json.loads(line)

    def package(self, name):
        """The folder of a package; None if there is none on this machine."""
        if name not in self._packages:
            self._packages[name] = self._ask({"package": name}).get("folder") or None
        return self._packages[name]

    def expand(self, file, arguments):
        """The text of the expanded file, and the file (empty where it will not be there when the robot starts).

        Raises RuntimeError with doppel's message.
        """
        if RECORDER.survey:
            # The actions do not depend on the robot's links.
            return '<robot name="surveyed"/>', file
        answer = self._ask({"xacro": file, "arguments": [[k, str(v)] for k, v in arguments.items()]})
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer.get("text", ""), answer.get("source", "")

    def write_file(self, name, text):
        """A file that the launch file makes, such as one with replaced values; returns its path."""
        if self._requests is not None:
            answer = self._ask({"write": name, "text": text})
            if "error" in answer:
                raise LaunchError(f"the file '{name}' cannot be made: {answer['error']}")
            return answer["file"]
        folder = self.folder or "/tmp"
        path = os.path.join(folder, name)
        count = 1
        while os.path.exists(path):
            count += 1
            path = os.path.join(folder, f"{count}_{name}")
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)
        return path

    def deliver(self, result):
        """The last line."""
        if self._requests is None:
            print(json.dumps(result, indent=1))
            return
        self._send({"result": result})


HOST = Host()

# A folder that stands for the share folder of a package that is not on this machine.
ABSENT = "/absent"


def share_folder(name, place=None):
    """The folder of a package, or one that names it: files in it do not exist. `place`: where it is looked up."""
    if place is not None:
        RECORDER.look_up(name, place)
    return HOST.package(name) or f"{ABSENT}/{name}"


def absent_package(path):
    """The package whose folder would have this file; empty if the path is not that of an absent package."""
    parts = str(path).split("/")
    return parts[2] if len(parts) > 2 and parts[1] == ABSENT[1:] else ""
