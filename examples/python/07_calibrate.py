"""Calibrates a joint's zero: where would the encoder have to be wrong for the measured tool positions?"""
import numpy as np

import doppel

model = doppel.Model.load("omarm_one")
joint, error = model.joints["Revolute 2"], 0.05  # rad, which the measurements do not show directly
one = np.eye(model.nq)[joint.q_index]
random = np.random.default_rng(4)
read = [model.neutral() + random.uniform(0, 0.5, model.nq) for _ in range(10)]
measured = [model.fk(q + error * one, "tool_link_1")[:3, 3] + random.normal(0, 1e-4, 3) for q in read]

offset = 0.0
for _ in range(5):  # Gauss-Newton
    corrected = [q + offset * one for q in read]
    columns = np.concatenate([model.jacobian(q, "tool_link_1")[3:, joint.v_index] for q in corrected])
    residual = np.concatenate([p - model.fk(q, "tool_link_1")[:3, 3] for p, q in zip(measured, corrected)])
    offset += columns @ residual / (columns @ columns)
print(f"the zero of Revolute 2 is off by {offset:.4f} rad (true: {error} rad)")
assert abs(offset - error) < 1e-3
