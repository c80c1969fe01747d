"""The reader of launch files as one process for many files: worker.py READER_FOLDER launch|check ALLOWED_FOLDER...

Each line of its input is the path of a launch file. It is read as `doppel launch` or `doppel check` reads it, with the memory of
the product's confined reader (src/doppel/base/core/confinement.cpp), and a line of JSON reports what the reading cost and did.
"""
import json
import os
import resource
import sys
import traceback

MAX_ADDRESS_SPACE = 4 << 30  # bytes, kMaxAddressSpace of confinement.cpp
MAX_DESCRIPTORS = 128        # kMaxConfinedDescriptors

# Reports of Python about what a program does to the rest of the system. Those of a class are listed by its prefix.
EFFECTS = ("os.chmod", "os.chown", "os.exec", "os.fork", "os.kill", "os.link", "os.mkdir", "os.posix_spawn", "os.remove", "os.rename",
           "os.rmdir", "os.spawn", "os.symlink", "os.system", "os.truncate", "os.utime", "shutil.", "signal.pthread_kill", "socket.",
           "subprocess.", "ctypes.", "urllib.")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

effects = []


def watch(allowed):
    """Records each effect, and each file outside of the folders that the reader may read that is opened."""
    def hook(event, arguments):
        if event == "open" and isinstance(arguments[0], (str, bytes)):
            path = os.path.abspath(os.fsdecode(arguments[0]))
            if (arguments[2] or 0) & WRITING:
                effects.append(f"it opens '{path}' to write")
            elif not path.startswith(allowed) and os.path.lexists(path):
                effects.append(f"it opens '{path}'")
        elif event.startswith(EFFECTS):
            effects.append(f"{event} {arguments!r:.200}")

    sys.addaudithook(hook)


def limit():
    for what, most in ((resource.RLIMIT_AS, MAX_ADDRESS_SPACE), (resource.RLIMIT_NOFILE, MAX_DESCRIPTORS),
                       (resource.RLIMIT_FSIZE, 0), (resource.RLIMIT_CORE, 0)):
        resource.setrlimit(what, (most, most))


def peak_memory():
    """The most memory that the process has had, in bytes. (ru_maxrss begins with that of the parent.)"""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) * 1024


def main():
    reader, mode, *allowed = sys.argv[1:]
    report = os.fdopen(os.dup(1), "w", encoding="utf-8")
    paths = os.fdopen(os.dup(0), "r", encoding="utf-8")
    sys.path[0] = reader
    for name, value in (("AMENT_PREFIX_PATH", ""), ("ROS_DISTRO", "jazzy"), ("ROS_VERSION", "2")):
        os.environ.setdefault(name, value)
    import read_launch_file
    import launch.launch_description_sources  # noqa: F401  (what a reading imports is not a part of its cost)
    import yaml  # noqa: F401

    sys.stdout = sys.stderr
    watch((*[os.path.join(one, "") for one in (reader, *allowed)], os.path.join(sys.prefix, "lib", ""), "/proc/self/status"))
    limit()
    for path in map(str.rstrip, paths):
        effects.clear()
        ended = ""
        before = time_used()
        try:
            if mode == "check":
                read_launch_file.survey([path])
            else:
                read_launch_file.RECORDER.__init__()
                read_launch_file.HOST.deliver(read_launch_file.read(path, []))
        except SystemExit:
            ended = "SystemExit"
        except BaseException as error:  # whatever passes the reader ends its process
            traceback.print_exc()
            ended = type(error).__name__
        sys.stderr.flush()
        used = time_used() - before
        report.write(json.dumps({"ended": ended, "time": used, "memory": peak_memory(), "effects": sorted(set(effects))}) + "\n")
        report.flush()


def time_used():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


main()
