"""A step of one joint's servo: rise time and overshoot, and a plot if matplotlib is installed."""
import numpy as np

import doppel

with doppel.Twin("omarm_one", controllers=False) as twin:
    twin.command[:] = twin.q[:7]
    twin.run_for(1.0)
    joint = twin.joint("Revolute 2")
    start, goal = joint.q, joint.q + 0.5
    joint.command = goal
    q = np.array([(twin.step(), joint.q)[1] for _ in range(1000)])
time, part = np.arange(1, 1001) * 1e-3, (q - start) / (q[-1] - start)
print(f"rise 10-90 %: {time[part > 0.9][0] - time[part > 0.1][0]:.3f} s, overshoot {100 * (part.max() - 1):.1f} %, "
      f"sag {1e3 * (goal - q[-1]):.1f} mrad")
try:
    from matplotlib import pyplot
    pyplot.plot(time, q)
    pyplot.savefig("step_response.png")
except ImportError:
    pass
