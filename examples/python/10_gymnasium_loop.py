"""The loop of Gymnasium in the environment doppel/Reach-v0: a policy that follows the Jacobian, while each episode has other masses,
friction and delays. With Gymnasium, env = gymnasium.make("doppel/Reach-v0", model=...).unwrapped is the same."""
import numpy as np

from doppel.envs import ReachEnv

env = ReachEnv("omarm_one", randomize="""
mass: [0.8, 1.2]       # factors
friction: [0.5, 2.0]
delay: [0.0, 0.03]     # s
""")
arm = len(env.action_space.low)
times = []
for seed in range(10):
    observation, info = env.reset(seed=seed)
    q = observation[:arm].copy()
    terminated = truncated = False
    while not (terminated or truncated):
        tool, target = observation[-6:-3], observation[-3:]
        J = env.model.jacobian(env.twin.q, env.tool)[3:, :arm]
        q += 0.2 * J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(3), target - tool)
        observation, reward, terminated, truncated, info = env.step(env.action_of(q))
    times += [env.twin.time] if terminated else []
print(f"reached {len(times)} of 10 targets, after {np.mean(times):.2f} s on average")
