"""A folder with a package, and with what a launch file must not be able to wait for, to read or to change."""
import os
import pathlib
import shutil

PACKAGE = pathlib.Path(__file__).resolve().parent / "package"
CANARY = "canary-51c9f2-of-somebody-else"


class World:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder).resolve()
        self.package = self.folder / "arm_description"
        shutil.copytree(PACKAGE, self.package)
        self.launch = self.package / "launch"
        for name in ("made", "temporary"):
            (self.folder / name).mkdir()
        # Files that an entity, a tag or an include can name, whose content must not be in what is delivered.
        self.secrets = {"the canary": CANARY}
        (self.launch / "canary.txt").write_text(CANARY + "\n")
        (self.launch / "canary.launch.yaml").write_text(f"launch: [{CANARY}]\n{CANARY}: *{CANARY}\n")
        (self.launch / "canary.dtd").write_text(f'<!ENTITY e "{CANARY}">\n')
        users = pathlib.Path("/etc/passwd")
        if users.is_file() and (first := users.read_text(errors="replace").partition("\n")[0]):
            self.secrets[str(users)] = first
        os.mkfifo(self.launch / "pipe.launch.xml")
        os.mkfifo(self.launch / "pipe.launch.yaml")
        os.mkfifo(self.launch / "pipe.launch.py")
        (self.launch / "folder.launch.xml").mkdir()
        (self.launch / "device.launch.xml").symlink_to("/dev/zero")
        (self.launch / "none.launch.xml").symlink_to("nowhere")
        self._mutated = None
        self._before = self._state()

    def write(self, name, data):
        """The file that is read next."""
        if self._mutated is not None and self._mutated.name != name:
            self._mutated.unlink(missing_ok=True)
        self._mutated = self.launch / name
        self._mutated.write_bytes(data)
        return self._mutated

    def changes(self):
        """Faults: what is not as it was, but for the file that was written here."""
        now = self._state()
        changed = sorted(str(one) for one in now.keys() | self._before.keys() if now.get(one) != self._before.get(one))
        self._before = now
        return [f"effect: {one} was changed" for one in changed]

    def answer(self, request, mode):
        """As LaunchReader::answer() in launch_reader.cpp; files are not written."""
        if "package" in request:
            return {"folder": str(self.package) if request["package"] == "arm_description" else ""}
        if "write" in request:
            return {"file": str(self.folder / "made" / os.path.basename(request["write"]))}
        if "xacro" not in request:
            return {}
        if mode == "check":
            return {"error": "xacro is not run"}
        file = request["xacro"]
        if not os.path.basename(file).startswith("arm.urdf") or "\0" in file or not os.path.isfile(file):
            return {"error": f"{file:.200}: error [file.unreadable]: it does not exist"}
        return {"text": '<robot name="arm"><link name="base"/></robot>', "source": file}

    def _state(self):
        out = {}
        for folder, folders, files in os.walk(self.folder):
            for name in (*folders, *files):
                path = pathlib.Path(folder, name)
                if path != self._mutated:
                    state = path.lstat()
                    out[path] = (state.st_mode, state.st_size if path.is_file() else 0, state.st_mtime_ns if path.is_file() else 0)
        return out
