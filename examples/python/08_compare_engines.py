"""The same motion in two physics engines: how far their joints differ."""
import numpy as np

import doppel

runs = {}
for engine in ("mujoco", "bullet"):
    with doppel.Twin("omarm_one", engine=engine) as twin:
        twin.controller("omarm_arm_controller").follow([1.0, 2.0], [np.full(6, 1.0), np.full(6, 0.6)], wait=False)
        runs[engine] = np.array([(twin.step(10), twin.q.copy())[1] for _ in range(250)])
difference = np.abs(runs["mujoco"] - runs["bullet"])
print(f"largest difference {1e3 * difference.max():.2f} mrad, at the end {1e3 * difference[-1].max():.2f} mrad")
assert difference[-1].max() < 0.02
