"""A controller in Python: each cycle reads q and v and writes commands."""
import math

import doppel

with doppel.Twin("omarm_one", controllers=False) as twin:
    twin.command[:] = twin.q[:7]
    centre, worst = twin.q.copy(), 0.0
    for cycle in range(300):  # 100 Hz for 3 s
        twin.command[0] = centre[0] + 0.3 * math.sin(2 * math.pi * 0.5 * twin.time)
        twin.step(10)
        worst = max(worst, abs(twin.command[0] - twin.q[0]))
print(f"follows a sine of 0.5 Hz within {1e3 * worst:.0f} mrad")
