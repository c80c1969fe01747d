"""Twin: stepping, state, controllers, the bus, sensors, recordings, rollouts."""
import gc
import json
import os
import tempfile
import threading
import unittest

import numpy as np

import doppel

PENDULUM = """<robot name="pendulum">
  <link name="world"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
    <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><origin xyz="0 0 2"/><axis xyz="0 1 0"/>
    <limit effort="100" velocity="100"/></joint>
</robot>"""


def resident_pages():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1])


class StepTest(unittest.TestCase):
    def test_ViewsFollowStateWithoutCopies(self):
        with doppel.Twin("omarm_one") as twin:
            q, v, effort = twin.q, twin.v, twin.effort
            before = q.copy()
            twin.step(300)
            self.assertIs(twin.q, q)
            self.assertFalse(np.array_equal(q, before))
            self.assertAlmostEqual(twin.time, 300 * twin.step_size, places=12)
            self.assertEqual(twin.steps, 300)
            self.assertEqual(twin.joint("Revolute 2").q, q[1])
            self.assertFalse(q.flags.writeable or v.flags.writeable or effort.flags.writeable)
            self.assertTrue(twin.command.flags.writeable)
            self.assertEqual((q.base is None, len(twin.command)), (False, 7))
        self.assertTrue(np.isfinite(q).all())  # the arrays outlive the twin

    def test_StepsInOneCallAreStepsOfManyCalls(self):
        with doppel.Twin("omarm_one") as one, doppel.Twin("omarm_one") as many:
            one.step(500)
            for _ in range(500):
                many.step()
            self.assertEqual(one.state_hash, many.state_hash)
            np.testing.assert_array_equal(one.q, many.q)

    def test_PendulumSwingsWithPeriodOfClosedForm(self):
        with doppel.Twin(PENDULUM, controllers=False, step=1e-4) as twin:
            with self.assertRaisesRegex(doppel.InputError, r"the shapes \[2\] and \[1\]"):
                twin.set_state([0.01, 0])
            twin.set_state([0.01])
            crossings, before = [], twin.q[0]
            while len(crossings) < 2:
                twin.step()
                if before < 0 <= twin.q[0]:
                    crossings.append(twin.time - twin.step_size * twin.q[0] / (twin.q[0] - before))
                before = twin.q[0]
            self.assertAlmostEqual(crossings[1] - crossings[0], 2 * np.pi * np.sqrt((0.25 + 1e-6) / (0.5 * 9.81)), places=3)

    def test_CommandIsHeldByServo(self):
        with doppel.Twin("omarm_one", controllers=False) as twin:
            twin.command[:] = 0.3
            twin.joint("Revolute 3").command = 0.6
            twin.run_for(3)
            np.testing.assert_allclose(twin.q[[0, 1, 3]], 0.3, atol=0.01)
            self.assertAlmostEqual(twin.joint("Revolute 3").q, 0.6, delta=0.01)
            held = twin.q[1]
            twin.command[1] = np.nan
            twin.run_for(0.5)
            self.assertGreater(abs(twin.q[1] - held), 0.1)

    def test_ClosedTwinIsRefusedAndItsArraysStay(self):
        with doppel.Twin(PENDULUM) as twin:
            twin.step(10)
            q = twin.q
        self.assertTrue(np.isfinite(q).all())
        for request in (twin.step, twin.save, lambda: twin.time, twin.topics, lambda: twin.subscribe("/clock")):
            with self.assertRaisesRegex(doppel.InputError, "is closed"):
                request()

    def test_CommandOfControlledJointIsRefusedAtOnce(self):
        with doppel.Twin("omarm_one") as twin:
            with self.assertRaisesRegex(doppel.InputError, "'omarm_arm_controller' commands this joint"):
                twin.joint("Revolute 2").command = 1.0
            self.assertTrue(np.isnan(twin.command).all())
            twin.joint("Revolute 2").command = np.nan
            twin.step()

    def test_CommandsOfControlledJointsAreRefusedOnceAndDiscarded(self):
        with doppel.Twin("omarm_one") as twin:
            twin.command[:] = 0.3
            with self.assertRaisesRegex(doppel.InputError, "'Revolute 1', 'Revolute 2'.*'omarm_arm_controller' commands these") as raised:
                twin.step()
            self.assertEqual(len(raised.exception.diagnostics), 2)  # of the controllers of arm and gripper
            self.assertEqual((twin.steps, np.isnan(twin.command).all()), (0, True))
            twin.step()
            self.assertEqual(twin.controller("arm").follow([0.5], [np.full(6, 0.1)])["error_code"], 0)

    def test_NumbersOutOfRangeAreRefusedByName(self):
        with doppel.Twin(PENDULUM, controllers=False) as twin:
            for name, request in (("n", lambda: twin.step(-1)), ("n", lambda: twin.step(1.5)), ("n", lambda: twin.step(2**64)),
                                  ("seconds", lambda: twin.run_for(-1)), ("seconds", lambda: twin.run_for(float("nan"))),
                                  ("seconds", lambda: twin.run_for("long")), ("speed", lambda: twin.run_for(1, speed=0)),
                                  ("timeout", lambda: twin.call("/get_entities", timeout=-1)),
                                  ("depth", lambda: twin.subscribe("/clock", depth=-1)), ("port", lambda: twin.view(port=70000)),
                                  ("seed", lambda: doppel.Twin(PENDULUM, seed=-1)), ("step", lambda: doppel.Twin(PENDULUM, step=-1)),
                                  ("threads", lambda: doppel.rollout(twin, None, np.zeros((1, 1, 1)), threads=-1)),
                                  ("command", lambda: setattr(twin.joint("hinge"), "command", "up")),
                                  ("q", lambda: twin.set_state("up"))):
                with self.assertRaisesRegex(doppel.InputError, f"error: {name} is .*it must be"):
                    request()
            self.assertEqual((twin.steps, twin.time), (0, 0))

    def test_ResetStartsSameRunAgain(self):
        with doppel.Twin("omarm_one", controllers=False) as twin:
            def run():
                twin.command[:] = 0.5
                twin.step(200)
                return twin.q.copy()
            first = run()
            twin.reset()
            self.assertEqual((twin.time, np.isnan(twin.command).all()), (0, True))
            np.testing.assert_array_equal(run(), first)

    def test_RestoredStateContinuesBitIdentically(self):
        with doppel.Twin("omarm_one") as twin:
            twin.step(100)
            goal = twin.controller("arm").follow([0.5], [np.full(6, 1.2)], wait=False)
            twin.step(100)
            state = twin.save()
            twin.step(300)
            expected, hash_before = twin.q.copy(), twin.state_hash
            twin.restore(state)
            self.assertAlmostEqual(twin.time, state.time)
            twin.step(300)
            np.testing.assert_array_equal(twin.q, expected)
            self.assertEqual(twin.state_hash, hash_before)
            self.assertIsNotNone(goal)

    def test_OtherThreadsRunWhileTwinSteps(self):
        with doppel.Twin("omarm_one") as twin:
            counted, done = 0, threading.Event()

            def work():
                twin.step(50_000)
                done.set()
            thread = threading.Thread(target=work)
            thread.start()
            while not done.is_set():
                counted += 1
            thread.join()
            self.assertGreater(counted, 10_000)

    def test_ThreadsReadTwinThatAnotherOneSteps(self):
        with doppel.Twin("omarm_one") as twin:
            robot, seen, failures, done = twin.robots[0], set(), [], threading.Event()

            def read():
                try:
                    while not done.is_set():
                        seen.add((twin.steps, twin.step_size))
                        self.assertGreaterEqual(twin.time, 0)
                        self.assertIsNotNone(twin.state_hash)
                        self.assertEqual((len(robot.link_poses()), len(twin.controllers())), (len(twin.model.links), 3))
                        self.assertIn("/joint_states", twin.topics())
                        self.assertIn("/controller_manager/list_controllers", twin.services())
                        self.assertEqual((twin.sensors(), repr(twin)[:20]), ([], "<doppel.Twin omarm: "))
                except BaseException as error:
                    failures.append(error)
            readers = [threading.Thread(target=read) for _ in range(3)]
            for reader in readers:
                reader.start()
            twin.step(50_000)
            done.set()
            for reader in readers:
                reader.join()
            self.assertEqual(failures, [])
            # All threads get the twin between parts of one call; what they see are the ends of such parts.
            self.assertGreater(len(seen), 5)

    def test_LongWaitForAnswerIsSharedWithOtherThreads(self):
        with doppel.Twin("omarm_one") as twin:
            goal = twin.controller("arm").follow([50.0], [np.full(6, 0.5)], wait=False)
            waiting = threading.Thread(target=goal.wait)
            waiting.start()
            times = set()
            while waiting.is_alive():
                times.add(twin.time)
            waiting.join()
            self.assertGreater(len(times), 5)

    def test_EnginesAndWorldsAreChosenByName(self):
        with doppel.Twin("omarm_one", engine="bullet") as twin:
            twin.run_for(0.2)
            self.assertTrue(np.isfinite(twin.q).all())
        world = os.path.join(os.environ["DOPPEL_ROOT"], "worlds", "table.yaml")
        with doppel.Twin("omarm_one", world=world, step=0.002) as twin:
            self.assertEqual(twin.step_size, 0.002)

    def test_TwoRobotsAreReadByTheirNamespaces(self):
        world = os.path.join(os.environ["DOPPEL_ROOT"], "worlds", "two_arms.yaml")
        with doppel.Twin(world=world) as twin:
            twin.step(10)
            self.assertEqual(len(twin.robots), 2)
            names = twin.robots.names
            self.assertEqual(len(twin.robots[names[1]].q), 8)
            self.assertEqual(set(twin.controllers()) & {f"{name}/omarm_arm_controller" for name in names},
                             {f"{name}/omarm_arm_controller" for name in names})


class RemovedRobotTest(unittest.TestCase):
    """The first of two robots is deleted by a service, which any client of the twin may call."""

    def setUp(self):
        self.twin = doppel.Twin([PENDULUM, PENDULUM], namespaces=["left", "right"], controllers=False)
        self.addCleanup(self.twin.close)
        self.left, self.right = self.twin.robots["left"], self.twin.robots["right"]

    def check_left_is_refused(self):
        hinge = self.left.joints["hinge"]
        for request in (lambda: self.left.q, lambda: self.left.effort, lambda: hinge.v, lambda: self.left.set_state([0.0]),
                        self.left.link_poses, lambda: self.twin.command, lambda: setattr(hinge, "command", 0.1),
                        lambda: doppel.rollout(self.twin, None, np.zeros((1, 1, 1)))):
            with self.assertRaisesRegex(doppel.InputError, r"the robot 'left' was removed \[python.robot_removed\]"):
                request()

    def test_OtherRobotsGoOnAfterDeletion(self):
        self.right.set_state([0.5])
        self.left.command[:] = 0.2
        self.twin.call("/delete_entity", {"name": "left"})
        self.twin.step(100)
        self.assertLess(self.right.q[0], 0.499)
        self.right.joints["hinge"].command = 0.3
        self.twin.run_for(3)
        self.assertAlmostEqual(self.right.joints["hinge"].q, 0.3, delta=0.01)
        self.assertIn("rod", self.right.link_poses())
        self.check_left_is_refused()

    def longer_pendulum(self, joints):
        more = "".join(f"""<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
          </inertial></link><joint name="j{i}" type="continuous"><parent link="{f'l{i - 1}' if i else 'rod'}"/><child link="l{i}"/>
          <limit effort="1" velocity="1"/></joint>""" for i in range(joints))
        return PENDULUM.replace("</robot>", more + "</robot>")

    def test_SpawnIsAnsweredWhereTwinStepsFasterThanRobotIsBuilt(self):
        request = {"name": "guest", "robot_namespace": "guest", "xml": self.longer_pendulum(60)}
        answer = self.twin.call("/spawn_entity", request, timeout=20)
        self.assertTrue(answer["success"], answer)

    def test_RobotSpawnedInSameNamespaceIsAnotherOne(self):
        longer = self.longer_pendulum(3)
        # Both are requested before the twin is stepped, so that no call sees the twin without a robot 'left'.
        self.twin._t.begin_call("/delete_entity", json.dumps({"name": "left"}))
        self.twin._t.begin_call("/spawn_entity", json.dumps({"name": "left", "robot_namespace": "left", "xml": longer}))
        for _ in range(100_000):
            self.twin.step(10)
            if len(self.twin._t.robots()) == 2:
                break
        self.twin.step()
        self.assertEqual([len(one["joints"]) for one in self.twin._t.robots()], [1, 4])
        self.check_left_is_refused()
        self.assertEqual(len(self.right.q), 1)


class MemoryTest(unittest.TestCase):
    def test_MemoryIsFlatOverManySteps(self):
        with doppel.Twin("omarm_one") as twin:
            twin.step(20_000)
            before = resident_pages()
            for _ in range(100_000):
                twin.step()
            self.assertLess(resident_pages() - before, 500)  # 2 MB

    def test_MemoryIsFlatOverManyTwins(self):
        model = doppel.Model.load(PENDULUM)

        def make(count):
            for _ in range(count):
                with doppel.Twin(model, controllers=False) as twin:
                    twin.step(5)
            gc.collect()
            return resident_pages()
        before = make(100)
        self.assertLess(make(300) - before, 500)  # 2 MB


class BusTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.twin = doppel.Twin("omarm_one")
        cls.twin.step(10)

    def test_TrajectoryEndsAtItsGoal(self):
        result = self.twin.controller("omarm_arm_controller").follow([1.0, 2.0], [np.full(6, 0.5), np.full(6, 0.7)])
        self.assertEqual(result["error_code"], 0)
        np.testing.assert_allclose(self.twin.q[:6], 0.7, atol=0.02)

    def test_RefusedTrajectoryRaisesReason(self):
        with self.assertRaisesRegex(doppel.ServiceError, "refused: .*time"):
            self.twin.controller("arm").follow([1.0, 0.5], [np.full(6, 0.5), np.full(6, 0.7)])
        with self.assertRaisesRegex(doppel.InputError, "1 rows of 6 numbers"):
            self.twin.controller("arm").follow([1.0], [[0.5]])
        with self.assertRaisesRegex(doppel.InputError, "no controller 'leg'"):
            self.twin.controller("leg")

    def test_MessagesAreDicts(self):
        states = self.twin.subscribe("/joint_states", depth=5)
        self.twin.run_for(0.5)
        messages = states.messages()
        self.assertEqual(len(messages), 5)
        self.assertEqual(messages[0]["name"][:2], ["Revolute 1", "Revolute 2"])
        self.assertEqual((states.messages(), states.latest), ([], messages[-1]))
        states.close()
        heard = self.twin.subscribe("/clock")
        self.twin.run_for(0.1)
        stamp = heard.latest["clock"]
        self.assertAlmostEqual(stamp["sec"] + 1e-9 * stamp["nanosec"], self.twin.time, delta=0.05)

    def test_PublishedMessagesReachSubscribers(self):
        self.twin.publish("/omarm_arm_controller/joint_trajectory", {
            "joint_names": [f"Revolute {i}" for i in range(1, 7)],
            "points": [{"positions": np.full(6, 0.9), "time_from_start": {"sec": 1}}]})
        self.twin.run_for(1.5)
        np.testing.assert_allclose(self.twin.q[:6], 0.9, atol=0.02)
        with self.assertRaisesRegex(doppel.InputError, "joint_names"):
            self.twin.publish("/omarm_arm_controller/joint_trajectory", {"joint_name": []})
        with self.assertRaisesRegex(doppel.InputError, "pass its type"):
            self.twin.publish("/nowhere", {})

    def test_ServicesAnswerWithDicts(self):
        answer = self.twin.call("/controller_manager/list_controllers")
        self.assertEqual({one["state"] for one in answer["controller"]}, {"active"})
        with self.assertRaisesRegex(doppel.InputError, "did you mean '/controller_manager/list_controllers'"):
            self.twin.call("/controller_manager/list_controler")

    def test_EveryCharacterAndNumberIsSent(self):
        node = "/omarm_arm_controller"
        for value, field, received in (({"type": 4, "string_value": "\N{ROBOT FACE}"}, "string_value", "\N{ROBOT FACE}"),
                                       ({"type": 8, "double_array_value": np.array([np.nan, np.inf, -np.inf, 0.1])},
                                        "double_array_value", [None, None, None, 0.1])):
            name = "\N{ROBOT FACE}." + field
            answer = self.twin.call(f"{node}/set_parameters", {"parameters": [{"name": name, "value": value}]})
            self.assertEqual(answer["results"], [{"successful": True, "reason": ""}])
            present = self.twin.call(f"{node}/get_parameters", {"names": [name]})
            self.assertEqual(present["values"][0][field], received)

    def test_ParametersAreReadAndSet(self):
        node = "/omarm_arm_controller"
        self.assertEqual(self.twin.parameters(node)["joints"][0], "Revolute 1")
        self.twin.set_parameter(node, "constraints.goal_time", 2.5)
        self.assertEqual(self.twin.parameters()[node]["constraints.goal_time"], 2.5)
        with self.assertRaisesRegex(doppel.InputError, "constraints.goal_time of /omarm_arm_controller: "):
            self.twin.set_parameter(node, "constraints.goal_time", "soon")


class SensorTest(unittest.TestCase):
    def test_CameraHasPicturesAfterPeriod(self):
        with doppel.Twin("lab_arm") as twin:
            camera = twin.camera("camera")
            with self.assertRaisesRegex(doppel.InputError, "no picture yet"):
                camera.rgb
            twin.run_for(0.1)
            picture = camera.rgb
            self.assertEqual((picture.dtype, picture.ndim, picture.shape[2]), (np.uint8, 3, 3))
            self.assertGreater(picture.std(), 1)
            self.assertAlmostEqual(camera.time, twin.time, delta=1 / camera.rate + twin.step_size)

    def test_DepthCameraGivesMetres(self):
        wall = PENDULUM.replace("</robot>", """
  <link name="wall"><visual><geometry><box size="0.1 4 4"/></geometry></visual></link>
  <joint name="far" type="fixed"><parent link="world"/><child link="wall"/><origin xyz="2.05 0 1"/></joint>
  <link name="eye"/><joint name="mount" type="fixed"><parent link="world"/><child link="eye"/><origin xyz="0 0 1"/></joint>
  <gazebo reference="eye"><sensor name="eye" type="depth_camera"><update_rate>20</update_rate><camera>
    <horizontal_fov>0.5</horizontal_fov><image><width>32</width><height>24</height></image>
    <clip><near>0.1</near><far>10</far></clip></camera></sensor></gazebo></robot>""")
        with doppel.Twin(wall, controllers=False) as twin:
            camera = twin.camera("eye")
            twin.run_for(0.2)
            self.assertEqual((camera.depth.shape, camera.depth.dtype), ((24, 32), np.float32))
            self.assertAlmostEqual(float(camera.depth[12, 16]), 2.0, places=3)

    def test_RecordingIsOneFileOfAllTopics(self):
        with tempfile.TemporaryDirectory() as folder, doppel.Twin("omarm_one") as twin:
            file = os.path.join(folder, "run.mcap")
            with twin.record(file) as recording:
                twin.run_for(0.5)
                with self.assertRaisesRegex(doppel.InputError, "still recorded"):
                    twin.record(file + "2")
            self.assertGreater(os.path.getsize(file), 10_000)
            self.assertEqual(recording.stop(), 0)
            with open(file, "rb") as written:
                data = written.read()
            self.assertTrue(data.startswith(b"\x89MCAP0\r\n") and data.endswith(b"\x89MCAP0\r\n"))


class RolloutTest(unittest.TestCase):
    def test_RolloutsAreBitIdenticalAtAnyNumberOfThreads(self):
        commands = np.random.default_rng(1).uniform(0, 1.5, (12, 40, 7))
        runs = [doppel.rollout("omarm_one", None, commands, threads=threads, steps_per_row=5) for threads in (1, 2, 8)]
        self.assertEqual(runs[0].shape, (12, 40, 16))
        np.testing.assert_array_equal(runs[0], runs[1])
        np.testing.assert_array_equal(runs[0], runs[2])
        self.assertEqual(len(np.unique(runs[0][:, -1, 0])), 12)

    def test_RolloutIsRunOfTwin(self):
        commands = np.random.default_rng(2).uniform(0, 1.5, (30, 7))
        states = doppel.rollout("omarm_one", None, commands, steps_per_row=10)
        with doppel.Twin("omarm_one", controllers=False) as twin:
            for row, state in zip(commands, states):
                twin.command[:] = row
                twin.step(10)
                np.testing.assert_array_equal(np.concatenate([twin.q, twin.v]), state)

    def test_StartsAndShapesAreChecked(self):
        model = doppel.Model.load(PENDULUM)
        starts = np.array([[0.1, 0.0], [0.2, 0.0]])
        states = doppel.rollout(model, starts, np.full((2, 10, 1), np.nan))
        self.assertGreater(states[1, -1, 0], states[0, -1, 0])
        with self.assertRaisesRegex(doppel.InputError, r"commands has the shape \[2, 10, 3\]"):
            doppel.rollout(model, starts, np.zeros((2, 10, 3)))
        with self.assertRaisesRegex(doppel.InputError, r"state0 has the shape \[2, 3\]"):
            doppel.rollout(model, np.zeros((2, 3)), np.zeros((2, 10, 1)))


if __name__ == "__main__":
    unittest.main()
