"""Environments: the task, seeds, randomisation, vectors, and Gymnasium's own checker where it is installed."""
import hashlib
import importlib.util
import math
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import warnings

import numpy as np

import doppel
from doppel import _spaces
from doppel.envs import ReachEnv, ReachVectorEnv

HAS_GYMNASIUM = importlib.util.find_spec("gymnasium") is not None
ALL = "start: [-0.1, 0.1]\nmass: [0.8, 1.2]\nfriction: [0.5, 2]\ndamping: [0.5, 2]\ndelay: [0, 0.03]\nposition_noise: 0.002\n" \
      "velocity_noise: [0.0, 0.05]\noverlay:\n- set_limit: Revolute 2\n  velocity: [2.0, 3.0]\n"


def run_hash(env, seed, steps=40):
    """Of all that an episode returns."""
    digest = hashlib.sha256()
    observation, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    for _ in range(steps):
        digest.update(observation.tobytes() + repr(sorted(info)).encode() + np.float64(info["distance"]).tobytes())
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        digest.update(np.array([reward, terminated, truncated]).tobytes())
    return digest.hexdigest()


class BoxTest(unittest.TestCase):
    def test_SamplesAreInsideAndOfSeed(self):
        box = _spaces.PlainBox(np.array([-1.0, -np.inf, 2.0, -np.inf]), np.array([1.0, np.inf, np.inf, 3.0]), seed=5)
        samples = [box.sample() for _ in range(200)]
        self.assertTrue(all(sample in box and sample.dtype == np.float32 for sample in samples))
        self.assertEqual(box.seed(5), 5)
        np.testing.assert_array_equal(samples, [box.sample() for _ in range(200)])
        self.assertGreater(np.std(samples, axis=0).min(), 0.4)
        self.assertFalse(np.array([2, 0, 2, 0], np.float32) in box or np.zeros(3, np.float32) in box or [0, 0, 2, 0] in box)
        self.assertFalse(np.array([0.0, 0.0, 2.0, 0.0]) in box)  # float64 does not fit
        for faulty in (lambda: _spaces.PlainBox(1.0, -1.0, (2,)), lambda: box.seed(-1), lambda: box.seed(0.5)):
            with self.assertRaises(doppel.InputError):
                faulty()


class ReachTest(unittest.TestCase):
    def test_PoseOfEveryTargetReachesIt(self):
        for robot in ("omarm_one", "desk_arm"):
            env = ReachEnv(robot)
            for seed in range(20):
                observation, info = env.reset(seed=seed)
                action, rewards = env.action_of(info["q_target"]), []
                terminated = truncated = False
                while not (terminated or truncated):
                    observation, reward, terminated, truncated, info = env.step(action)
                    rewards.append(reward)
                self.assertTrue(terminated and info["is_success"], (robot, seed, info))
                self.assertLess(math.dist(observation[-6:-3], observation[-3:]), 0.01)
                self.assertAlmostEqual(rewards[-1], -math.dist(observation[-6:-3], observation[-3:]), places=15)
                self.assertGreater(rewards[-1], rewards[0])

    def test_ObservationHasStateToolAndTarget(self):
        env = ReachEnv("omarm_one")
        _, info = env.reset(seed=1)
        observation = env.step(np.full(6, -0.5, np.float32))[0]
        self.assertEqual((env.tool, observation.shape, env.action_space.shape), ("tool_link_1", (18,), (6,)))
        np.testing.assert_array_equal(observation[:6], env.twin.q[:6])
        np.testing.assert_array_equal(observation[6:12], env.twin.v[:6])
        np.testing.assert_allclose(observation[12:15], env.model.fk(env.twin.q, env.tool)[:3, 3], atol=1e-12)
        q = env.twin.q.copy()
        q[:6] = info["q_target"]
        np.testing.assert_allclose(observation[15:], env.model.fk(q, env.tool)[:3, 3], atol=1e-9)
        self.assertTrue(observation in env.observation_space)

    def test_ActionsAreScaledToLimits(self):
        env = ReachEnv("desk_arm", tool="gripper_frame_link")
        env.reset(seed=0)
        for action, name in ((-1.0, "lower"), (1.0, "upper"), (7.0, "upper")):
            env.step(np.full(5, action))
            limits = [getattr(env.model.joints[joint], name) for joint in env.model.driven[:5]]
            np.testing.assert_allclose(env.twin.command[:5], limits, atol=1e-12)
        self.assertEqual(env.twin.command[5], env._held[5])  # the jaw is no part of the arm
        np.testing.assert_allclose(env.action_of([-1.9, 1.7, 0, 9, 0]), [-1, 1, 0, 1, 0], atol=1e-7)

    def test_EpisodeIsTruncatedAfterItsSteps(self):
        env = ReachEnv("omarm_one", max_steps=7)
        observation, _ = env.reset(seed=0, options={"target": [5.0, 0, 0]})
        np.testing.assert_array_equal(observation[-3:], [5.0, 0, 0])
        ends = [env.step(np.zeros(6))[2:4] for _ in range(7)]
        self.assertEqual(ends, [(False, False)] * 6 + [(False, True)])
        self.assertAlmostEqual(env.twin.time, 7 * 0.02)
        self.assertEqual(ReachEnv("omarm_one").max_steps, 200)
        self.assertGreater(ReachEnv("omarm_zero").max_steps, 800)  # its base turns by 0.2 rad/s

    def test_MobileArmReachesToo(self):
        env = ReachEnv("kate", world=None)
        _, info = env.reset(seed=1)
        self.assertEqual((env.tool, len(env.action_space.low)), ("katana_gripper_tool_frame", 5))
        for _ in range(env.max_steps):
            *_, terminated, truncated, _ = env.step(env.action_of(info["q_target"]))
            if terminated:
                break
        self.assertTrue(terminated)

    def test_DivergedPhysicsTruncatesWithLastState(self):
        env = ReachEnv("omarm_one")
        before, _ = env.reset(seed=0)
        with unittest.mock.patch.object(env.twin, "step", side_effect=doppel.InputError("diverged")):
            observation, reward, terminated, truncated, info = env.step(np.zeros(6))
        np.testing.assert_array_equal(observation, before)
        self.assertEqual((terminated, truncated, info["diverged"], reward), (False, True, True, -info["distance"]))
        env.reset()
        self.assertFalse(env.step(np.zeros(6))[3])

    def test_FaultyUseIsRefusedWithReason(self):
        env = ReachEnv("omarm_one")
        with self.assertRaisesRegex(doppel.InputError, "call reset"):
            env.step(np.zeros(6))
        env.reset()
        for request, why in ((lambda: env.step(np.zeros(5)), "must be 6 numbers"), (lambda: env.step(np.full(6, np.nan)), "must be 6 numbers"),
                             (lambda: env.reset(options={"goal": 1}), "no option 'goal'"),
                             (lambda: env.reset(options={"target": [1, 2]}), "three finite numbers"),
                             (lambda: ReachEnv("omarm_one", tool="tool_link"), "did you mean 'tool_link_1'"),
                             (lambda: ReachEnv("omarm_one", tool="base_link"), "no joint moves"),
                             (lambda: ReachEnv("omarm_one", render_mode="rgb_array"), "has no camera"),
                             (lambda: ReachEnv("lab_arm", render_mode="human"), "must be None or 'rgb_array'"),
                             (lambda: ReachEnv("omarm_one", period=0), "above zero"),
                             (lambda: ReachEnv(env.model, randomize={"mass": 2}), "a Model cannot be randomised"),
                             (lambda: ReachVectorEnv(0), "at least 1")):
            with self.subTest(why), self.assertRaisesRegex(doppel.InputError, why):
                request()


class SeedTest(unittest.TestCase):
    def test_EqualSeedsGiveEqualRunsBitForBit(self):
        for randomize in (None, ALL):
            first, second = ReachEnv("omarm_one", randomize=randomize), ReachEnv("omarm_one", randomize=randomize)
            expected = run_hash(first, 3)
            self.assertNotEqual(run_hash(first, 4), expected)
            self.assertEqual(run_hash(first, 3), expected)  # whatever was run before
            self.assertEqual(run_hash(second, 3), expected)
            first.close()
            second.close()

    def test_GeneratorIsThatOfGymnasium(self):
        env = ReachEnv("omarm_one")
        env.reset(seed=123)
        self.assertEqual(env.np_random_seed, 123)
        expected = np.random.Generator(np.random.PCG64(np.random.SeedSequence(123)))
        env.reset(seed=123, options={"target": [1, 0, 0]})  # without a draw
        self.assertEqual(env.np_random.random(), expected.random())
        state = env.np_random.bit_generator.state
        env.reset(options={"target": [1, 0, 0]})
        self.assertEqual(env.np_random.bit_generator.state, state)  # without a seed it goes on


class RandomizeTest(unittest.TestCase):
    def test_MassesFrictionAndOverlayAreThoseDrawn(self):
        env = ReachEnv("omarm_one", randomize=ALL)
        masses = set()
        for seed in range(3):
            _, info = env.reset(seed=seed)
            drawn, model, nominal = info["randomized"], env.twin.model, env.model
            masses.add(model.mass)
            self.assertAlmostEqual(model.mass, nominal.mass * drawn["mass"], places=9)
            self.assertTrue(0.8 <= drawn["mass"] <= 1.2 and 0 <= drawn["delay"] <= 0.03)
            for number, name in enumerate(nominal.driven):
                self.assertAlmostEqual(model.joints[name].friction, nominal.joints[name].friction * drawn["friction"][number])
                self.assertAlmostEqual(model.joints[name].damping, nominal.joints[name].damping * drawn["damping"][number])
            self.assertTrue(2 <= model.joints["Revolute 2"].velocity <= 3)
        self.assertEqual(len(masses), 3)

    def test_OverlayOfUserIsKept(self):
        overlay = "- set_limit: Revolute 2\n  velocity: 1.5\n"
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "corrections.yaml")
            with open(file, "w", encoding="utf-8") as out:
                out.write(overlay)
            for source in (overlay, file):
                env = ReachEnv("omarm_one", overlay=source, randomize={"mass": [2, 2]})
                env.reset(seed=0)
                self.assertEqual(env.twin.model.joints["Revolute 2"].velocity, 1.5)
                self.assertAlmostEqual(env.twin.model.mass, 2 * env.model.mass)

    def test_TextFileAndDictDrawTheSame(self):
        yaml = "friction: [0.5, 2]\nmass: [0.8, 1.2]\n"
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "randomize.yaml")
            with open(file, "w", encoding="utf-8") as out:
                out.write(yaml)
            runs = [run_hash(ReachEnv("desk_arm", randomize=source), 1, 10)
                    for source in (yaml, file, {"mass": [0.8, 1.2], "friction": (0.5, 2)})]
        self.assertEqual(len(set(runs)), 1)

    def test_CommandsActAfterTheirDelay(self):
        late, prompt = ReachEnv("omarm_one", randomize={"delay": 0.03}), ReachEnv("omarm_one")
        for env in (late, prompt):
            env.reset(seed=0, options={"target": [5, 0, 0]})
        go = np.full(6, 0.5)
        prompt.twin.step(30)  # 0.03 s, in which the start is held
        for _ in range(10):
            late.step(go)
            prompt.step(go)
        late.twin.step(30)
        np.testing.assert_allclose(late.twin.q, prompt.twin.q, atol=1e-9)
        self.assertGreater(np.abs(late.twin.q[:6] - late._rest[:6]).max(), 0.1)

    def test_NoiseIsThatOfObservationsOnly(self):
        env = ReachEnv("omarm_one", randomize={"position_noise": 0.01})
        env.reset(seed=0, options={"target": [5, 0, 0]})
        errors = np.array([env.step(np.zeros(6))[0][:6] - env.twin.q[:6] for _ in range(100)])
        self.assertAlmostEqual(errors.std(), 0.01, delta=0.001)
        np.testing.assert_array_equal(env.step(np.zeros(6))[0][6:12], env.twin.v[:6])

    def test_FaultyYamlIsRefusedWithPlace(self):
        for yaml, why in (("mass: [0.9, 1.1]\nfricton: 1\n", "text:2:1: error: .*'fricton'.*did you mean 'friction'"),
                          ("mass: [1.1, 0.9]\n", "text:1:1: .*the lower one first"), ("mass: heavy\n", "must be a number or a range"),
                          ("mass: [1, 2, 3]\n", "must be a number or a range"), ("delay: -0.1\n", "of 0 or more"),
                          ("mass: .nan\n", "finite"), ("- mass: 1\n", "not a mapping"), ("mass: [1, 2\nx: {", "text:.*is not YAML"),
                          ("overlay: 3\n", "not a list of operations"), ("no_such_file.yaml", "cannot be read")):
            with self.subTest(yaml), self.assertRaisesRegex(doppel.InputError, why):
                ReachEnv("omarm_one", randomize=yaml)
        env = ReachEnv("omarm_one", randomize={"overlay": [{"set_limt": "Revolute 2", "velocity": [1, 2]}]})
        with self.assertRaisesRegex(doppel.InputError, "did you mean 'set_limit'"):
            env.reset()


class VectorTest(unittest.TestCase):
    def test_PartsAreSingleEnvironmentsWhateverTheThreads(self):
        actions = np.random.default_rng(0).uniform(-1, 1, (30, 5, 6))
        runs = []
        for threads in (1, 3):
            envs = ReachVectorEnv(5, model="omarm_one", randomize=ALL, threads=threads, max_steps=12)
            observations, infos = envs.reset(seed=10)
            out = [observations, infos["distance"]]
            for action in actions:
                observations, rewards, terminated, truncated, infos = envs.step(action)
                out += [observations, rewards, terminated, truncated]
            runs.append([values.tobytes() for values in out])
            self.assertEqual((envs.np_random_seed, infos["_distance"].all()), ((10, 11, 12, 13, 14), True))
            envs.close()
            envs.close()
        self.assertEqual(*runs)
        single = ReachEnv("omarm_one", randomize=ALL, max_steps=12)
        observation, _ = single.reset(seed=12)
        self.assertEqual(observation.tobytes(), np.frombuffer(runs[0][0]).reshape(5, 18)[2].tobytes())
        for action in actions[:12]:
            observation = single.step(action[2])[0]
        self.assertEqual(observation.tobytes(), np.frombuffer(runs[0][2 + 4 * 11]).reshape(5, 18)[2].tobytes())

    def test_EndedPartsBeginAgainByMode(self):
        action = np.zeros((2, 6))
        later = ReachVectorEnv(2, max_steps=3)
        later.reset(seed=0)
        ends = [later.step(action)[1:4] for _ in range(5)]
        self.assertEqual([truncated.tolist() for _, _, truncated in ends], [[False] * 2] * 2 + [[True] * 2] + [[False] * 2] * 2)
        self.assertEqual((ends[3][0].tolist(), (ends[4][0] < 0).all()), ([0.0, 0.0], True))  # the fourth step ignores its action
        same = ReachVectorEnv(2, max_steps=3, autoreset_mode="SameStep")
        first, _ = same.reset(seed=0)
        same.step(action), same.step(action)
        observations, rewards, _, truncated, infos = same.step(action)
        self.assertEqual((truncated.all(), infos["_final_obs"].all(), "q_target" in infos), (True, True, True))
        np.testing.assert_array_equal(infos["final_obs"][0][-3:], first[0, -3:])
        np.testing.assert_array_equal(rewards, -infos["final_info"]["distance"])
        self.assertFalse((observations[:, -3:] == first[:, -3:]).any())
        manual = ReachVectorEnv(2, max_steps=3, autoreset_mode="Disabled")
        manual.reset(seed=0)
        for _ in range(3):
            before = manual.step(action)[0]
        with self.assertRaisesRegex(doppel.InputError, "environment 0 has ended"):
            manual.step(action)
        after, infos = manual.reset(options={"reset_mask": np.array([True, False])})
        self.assertEqual((infos["_distance"].tolist(), (after[0] == before[0]).all(), (after[1] == before[1]).all()), ([True, False], False, True))
        manual.envs[1].reset()


class RenderTest(unittest.TestCase):
    def test_PicturesAreOfEpisodeAndChangeNothing(self):
        seen, blind = ReachEnv("lab_arm", render_mode="rgb_array"), ReachEnv("lab_arm")
        for env in (seen, blind):
            env.reset(seed=1)
        self.assertIsNone(blind.render())
        picture = seen.render()
        self.assertEqual((picture.dtype, picture.ndim, picture.shape[2], picture.std() > 1), (np.uint8, 3, 3, True))
        for _ in range(20):
            seen.render()
            self.assertEqual(seen.step(np.full(4, 0.5))[0].tobytes(), blind.step(np.full(4, 0.5))[0].tobytes())
        self.assertGreater(np.abs(seen.render().astype(float) - picture).mean(), 1)
        seen.reset(seed=1)
        np.testing.assert_array_equal(seen.render(), picture)


WITHOUT = "import sys; sys.modules['gymnasium'] = None; import test_envs; print(test_envs.run_hash(test_envs.ReachEnv('desk_arm'), 7))"


class GymnasiumTest(unittest.TestCase):
    def test_WithoutGymnasiumNumbersAreTheSame(self):
        run = subprocess.run([sys.executable, "-c", WITHOUT], cwd=os.path.dirname(__file__), capture_output=True, text=True, check=False)
        self.assertEqual(run.stdout.strip(), run_hash(ReachEnv("desk_arm"), 7), run.stderr)

    @unittest.skipUnless(HAS_GYMNASIUM, "gymnasium is not installed")
    def test_CheckerOfGymnasiumPasses(self):
        import gymnasium
        from gymnasium.utils.env_checker import check_env
        for options in (dict(model="omarm_one"), dict(model="desk_arm", randomize=ALL.replace("Revolute 2", "elbow_flex")),
                        dict(model="lab_arm")):
            env = gymnasium.make("doppel/Reach-v0", **options)
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", ".*infinity. This is probably.*")
                warnings.simplefilter("error", append=True)
                check_env(env.unwrapped)
            env.close()

    @unittest.skipUnless(HAS_GYMNASIUM, "gymnasium is not installed")
    def test_VectorOfGymnasiumHasSameNumbers(self):
        import gymnasium
        runs = []
        for mode in (None, "sync"):
            envs = gymnasium.make_vec("doppel/Reach-v0", num_envs=3, vectorization_mode=mode, model="omarm_one", max_steps=5)
            out = [envs.reset(seed=1)]
            out += [envs.step(np.full((3, 6), 0.1, np.float32)) for _ in range(8)]
            runs.append([[np.asarray(value).tobytes() for value in one[:-1]] + [sorted(one[-1])] for one in out])
            envs.close()
        self.assertEqual(*runs)

    @unittest.skipUnless(HAS_GYMNASIUM, "gymnasium is not installed")
    def test_BoxSamplesAreThoseOfGymnasium(self):
        import gymnasium
        bounds = np.array([-1.0, -np.inf, 2.0, -np.inf]), np.array([1.0, np.inf, np.inf, 3.0])
        ours = _spaces.PlainBox(*bounds, dtype=np.float64, seed=5)
        theirs = gymnasium.spaces.Box(*bounds, dtype=np.float64, seed=5)
        for _ in range(50):
            np.testing.assert_array_equal(ours.sample(), theirs.sample())


if __name__ == "__main__":
    unittest.main()
