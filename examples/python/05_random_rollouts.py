"""Random commands for many copies of an arm at once: how far its tool gets."""
import time

import numpy as np

import doppel

model = doppel.Model.load("omarm_one")
low = np.array([model.joints[name].lower for name in model.driven])
high = np.array([model.joints[name].upper for name in model.driven])
commands = np.random.default_rng(1).uniform(low, high, (100, 20, len(low)))
start = time.perf_counter()
states = doppel.rollout(model, None, commands, steps_per_row=50)
took = time.perf_counter() - start
tips = [model.fk(q, "tool_link_1")[:3, 3] for q in states[:, -1, :model.nq]]
print(f"{states.shape[0] * states.shape[1] * 50 / took:,.0f} steps per second; tools reach "
      f"{np.linalg.norm(tips, axis=1).max():.3f} m from the base, and {np.min(tips, axis=0)[2]:.3f} m above the table at least")
