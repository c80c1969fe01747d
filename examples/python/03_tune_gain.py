"""Tunes the gains of a PD controller of one's own: the smallest settling time without an overshoot of more than 2 %."""
import itertools

import doppel

ROBOT = """<robot name="slider"><link name="world"/>
  <link name="cart"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="rail" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="200" velocity="20"/><dynamics damping="1"/></joint></robot>"""


def settling_time(p, d):
    state, late, highest = [0.0, 0.0], 0.0, 0.0
    for step in range(100):  # 10 ms each, the force held in between
        force = p * (1 - state[0]) - d * state[1]
        state = doppel.rollout(twin, state, [[force]], mode="effort", steps_per_row=10)[-1]
        late, highest = (0.01 * (step + 1), max(highest, state[0])) if abs(state[0] - 1) > 0.02 else (late, max(highest, state[0]))
    return late if highest < 1.02 else float("inf")


with doppel.Twin(ROBOT, controllers=False, step=0.001) as twin:
    tried = {(p, d): settling_time(p, d) for p, d in itertools.product((50, 100, 200), (10, 20, 30, 40))}
best = min(tried, key=lambda gains: tried[gains])
print(f"p {best[0]} N/m, d {best[1]} N s/m: settled after {tried[best]:.2f} s")
