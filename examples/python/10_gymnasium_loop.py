"""The loop of Gymnasium over a twin: reset() and step() with observation, reward, terminated, truncated and info."""
import numpy as np

import doppel


class Reach:
    goal = np.array([0.15, 0.1, 0.25])  # m

    def reset(self, seed=0):
        self.twin = doppel.Twin("omarm_one", controllers=False, seed=seed)
        return np.concatenate([self.twin.q, self.twin.v]), {}

    def step(self, action):  # rad
        self.twin.command[:] = action
        self.twin.step(20)
        distance = np.linalg.norm(self.twin.robots[0].link_poses()["tool_link_1"][:3, 3] - self.goal)
        return np.concatenate([self.twin.q, self.twin.v]), -distance, distance < 0.01, self.twin.time > 4, {}


env, total, done = Reach(), 0.0, False
observation, info = env.reset(seed=1)
action = env.twin.model.ik(env.goal, "tool_link_1", seed=env.twin.q)[:7]
while not done:
    observation, reward, terminated, truncated, info = env.step(action)
    total, done = total + reward, terminated or truncated
print(f"return {total:.2f}, {'reached' if terminated else 'not reached'} after {env.twin.time:.2f} s")
