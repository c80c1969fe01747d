"""Prints what the package costs: the import, steps from Python beside those of the program, rollouts, memory.

    PYTHONPATH=build/python python3 python/tests/bench.py [build/bin/doppel]
"""
import gc
import re
import resource
import subprocess
import sys
import time

STEPS = 20_000


def rate(call, steps):
    best = float("inf")
    for _ in range(3):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return steps / best


def import_time():
    program = "import time; t = time.perf_counter(); import doppel; print(time.perf_counter() - t)"
    return min(float(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout)
               for _ in range(5))


def program_rate(doppel_program):
    run = subprocess.run([doppel_program, "up", "omarm_one", "--headless", "--speed", "max", "--duration", str(STEPS * 1e-3),
                          "--no-open", "--no-ros", "--no-reload", "--no-rewind", "--black-box", "0"], capture_output=True, text=True, check=False)
    found = re.search(r"([\d.]+) x real time", run.stderr)
    return float(found.group(1)) / 1e-3 if found else float("nan")


def resident():
    """MB of memory of this process."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def bench_memory():
    """Growth over a million steps, and over a thousand twins that are made and dropped, after the first of each."""
    import doppel
    model = doppel.Model.load("omarm_one")
    with doppel.Twin(model) as twin:
        twin.step(20_000)
        before = resident()
        twin.step(1_000_000)
        print(f"memory over 1,000,000 steps  {resident() - before:8.2f} MB")

    def make(count):
        for _ in range(count):
            with doppel.Twin(model) as made:
                made.step(2)
        gc.collect()
        return resident()
    before = make(100)
    print(f"memory over 1,000 twins      {make(1000) - before:8.2f} MB of {before:.0f}")


def bench_environments():
    """Actions of doppel/Reach-v0, of 20 steps each."""
    from doppel.envs import ReachEnv, ReachVectorEnv
    env = ReachEnv("omarm_one", max_steps=10_000)
    env.reset(seed=1, options={"target": [5, 0, 0]})
    actions = [env.action_space.sample() for _ in range(1000)]
    print(f"environment, actions         {rate(lambda: [env.step(action) for action in actions], 1000):8.0f} /s")
    for threads in (1, 2):
        envs = ReachVectorEnv(16, model="omarm_one", max_steps=10_000, threads=threads)
        envs.reset(seed=1, options={"target": [5, 0, 0]})
        speed = rate(lambda: [envs.step(envs.action_space.sample()) for _ in range(100)], 1600)
        print(f"16 environments, {threads} thread(s) {speed:8.0f} /s")


def main():
    print(f"import doppel                {1e3 * import_time():8.1f} ms")
    import numpy as np

    import doppel
    twin = doppel.Twin("omarm_one")
    twin.step(1000)

    def one_by_one():
        for _ in range(STEPS):
            twin.step()
    many = rate(lambda: [twin.step(1000) for _ in range(STEPS // 1000)], STEPS)
    single = rate(one_by_one, STEPS)
    print(f"steps, 1,000 in a call       {many:8.0f} /s")
    print(f"steps, one in a call         {single:8.0f} /s   {single / many:.3f} of that")
    if len(sys.argv) > 1:
        program = max(program_rate(sys.argv[1]) for _ in range(3))
        print(f"steps of the program         {program:8.0f} /s   Python has {many / program:.3f} of that")
    commands = np.random.default_rng(1).uniform(0, 1, (64, 50, len(twin.command)))
    for threads in (1, 2):
        speed = rate(lambda: doppel.rollout(twin, None, commands, threads=threads, steps_per_row=20), 64 * 50 * 20)
        print(f"rollouts, {threads} thread(s)        {speed:8.0f} /s")
    bench_environments()
    bench_memory()


if __name__ == "__main__":
    main()
