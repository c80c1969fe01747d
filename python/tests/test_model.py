"""Model: numbers against closed forms, and against each other."""
import math
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import doppel

# A pendulum of two links in the plane x-z: rods without thickness, masses at their ends.
L1, L2, M1, M2, G = 0.4, 0.3, 2.0, 1.5, 9.81
PENDULUM = f"""<robot name="pendulum">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 {-L1}"/><mass value="{M1}"/>
    <inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 {-L2}"/><mass value="{M2}"/>
    <inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="100" velocity="10"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 {-L1}"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/></joint>
  <joint name="end" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0 0 {-L2}"/></joint>
</robot>"""
Q, V, A = np.array([0.3, -0.7]), np.array([1.1, -0.4]), np.array([0.5, 2.0])


def closed_form(q, v, a):
    """tau of the planar double pendulum, with angles from the vertical down; signs of a rotation about +y."""
    c2, s2 = math.cos(q[1]), math.sin(q[1])
    m11 = (M1 + M2) * L1**2 + M2 * L2**2 + 2 * M2 * L1 * L2 * c2
    m12 = M2 * L2**2 + M2 * L1 * L2 * c2
    M = np.array([[m11, m12], [m12, M2 * L2**2]])
    h = M2 * L1 * L2 * s2
    coriolis = np.array([-h * (2 * v[0] * v[1] + v[1]**2), h * v[0]**2])
    g2 = M2 * G * L2 * math.sin(q[0] + q[1])
    gravity = np.array([(M1 + M2) * G * L1 * math.sin(q[0]) + g2, g2])
    return M, M @ a + coriolis + gravity, gravity


class PendulumTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = doppel.Model.load(PENDULUM)

    def test_DynamicsOfPendulumAreThoseOfClosedForm(self):
        M, tau, gravity = closed_form(Q, V, A)
        np.testing.assert_allclose(self.model.mass_matrix(Q), M, atol=1e-8)
        np.testing.assert_allclose(self.model.rnea(Q, V, A), tau, atol=1e-7)
        np.testing.assert_allclose(self.model.gravity(Q), gravity, atol=1e-9)
        np.testing.assert_allclose(self.model.gravity(Q, gravity=(0, 0, -1.62)), gravity * 1.62 / G, atol=1e-9)

    def test_PoseOfTipIsThatOfClosedForm(self):
        X = self.model.fk(Q, "tip")
        angle = Q.sum()
        np.testing.assert_allclose(X[:3, 3], [-L1 * math.sin(Q[0]) - L2 * math.sin(angle), 0,
                                              -L1 * math.cos(Q[0]) - L2 * math.cos(angle)], atol=1e-12)
        np.testing.assert_allclose(doppel.quat_wxyz(X), [math.cos(angle / 2), 0, math.sin(angle / 2), 0], atol=1e-12)
        self.assertEqual(self.model.fk(Q).shape, (4, 4, 4))

    def test_JacobianIsDerivativeOfPose(self):
        J, h = self.model.jacobian(Q, "lower", (0.01, 0.02, -0.1)), 1e-6
        point = np.array([0.01, 0.02, -0.1, 1])
        for i in range(2):
            step = np.eye(2)[i] * h
            moved = (self.model.fk(Q + step, "lower") - self.model.fk(Q - step, "lower")) @ point / (2 * h)
            np.testing.assert_allclose(J[3:, i], moved[:3], atol=1e-8)
        np.testing.assert_allclose(J[:3], [[0, 0], [1, 1], [0, 0]], atol=1e-12)

    def test_JointsAndLinksAreReadByNumberAndByName(self):
        joint = self.model.joints["elbow"]
        self.assertIs(joint, self.model.joints[1])
        self.assertEqual((joint.type, joint.parent, joint.child, joint.q_index, joint.effort), ("revolute", "upper", "lower", 1, 50))
        self.assertEqual(self.model.links["lower"].mass, M2)
        np.testing.assert_allclose(self.model.links["lower"].com, [0, 0, -L2])
        self.assertEqual(self.model.driven, ["shoulder", "elbow"])
        self.assertIn("elbow", self.model.joints)
        self.assertEqual(self.model.links.names, ["base", "upper", "lower", "tip"])

    def test_JointsAreMappingOfNamesInOrder(self):
        joints = self.model.joints
        self.assertEqual((list(joints), joints.names), (["shoulder", "elbow", "end"],) * 2)
        self.assertEqual([joint.name for joint in joints.values()], joints.names)
        self.assertEqual({name: joint.effort for name, joint in joints.items() if joint.nq}, {"shoulder": 100, "elbow": 50})
        self.assertIs(dict(joints)["elbow"], joints[1])
        self.assertIs(joints[-1], joints["end"])
        self.assertEqual([joint.name for joint in joints[:2]], ["shoulder", "elbow"])
        self.assertEqual((joints.get("elbow").name, joints.get("knee"), "knee" in joints, len(joints)), ("elbow", None, False, 3))

    def test_LimitsAreArraysInOrderOfConfiguration(self):
        floating = doppel.Model.load(PENDULUM, base="floating")
        np.testing.assert_array_equal(floating.lower_limits, [-np.inf] * 7 + [-3, -3])
        np.testing.assert_array_equal(floating.upper_limits, [np.inf] * 7 + [3, 3])
        np.testing.assert_array_equal(self.model.velocity_limits, [10, 10])
        np.testing.assert_array_equal(self.model.effort_limits, [100, 50])
        self.model.upper_limits[0] = 0  # of a copy
        self.assertEqual(self.model.upper_limits[0], 3)

    def test_ForwardDynamicsIsInverseOfRnea(self):
        np.testing.assert_allclose(self.model.forward_dynamics(Q, V, closed_form(Q, V, A)[1]), A, atol=1e-6)
        np.testing.assert_allclose(self.model.forward_dynamics(Q, 0 * V, self.model.gravity(Q)), [0, 0], atol=1e-9)
        light = doppel.Model.load(PENDULUM.replace(f'<mass value="{M2}"/>', '<mass value="0"/>').replace("1e-9", "0"))
        self.assertTrue(np.isfinite(light.forward_dynamics(Q, V, A)).all())  # a mass was estimated

    def test_CentreOfMassIsThatOfClosedForm(self):
        p1 = -L1 * np.array([math.sin(Q[0]), 0, math.cos(Q[0])])
        p2 = p1 - L2 * np.array([math.sin(Q.sum()), 0, math.cos(Q.sum())])
        np.testing.assert_allclose(self.model.com(Q), (M1 * p1 + M2 * p2) / (M1 + M2), atol=1e-12)

    def test_FloatingBaseHasSevenPositionsAndSixVelocities(self):
        floating = doppel.Model.load(PENDULUM, base="floating")
        self.assertEqual((floating.nq, floating.nv), (9, 8))
        np.testing.assert_allclose(floating.neutral()[:7], [0, 0, 0, 0, 0, 0, 1])


class OmarmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = doppel.Model.load("omarm_one")

    def test_InverseDynamicsAreMassMatrixTimesAccelerationPlusBias(self):
        random = np.random.default_rng(7)
        for _ in range(20):
            q, v, a = self.model.neutral() + random.uniform(0, 0.5, 8), random.normal(size=8), random.normal(size=8)
            bias = self.model.rnea(q, v, np.zeros(8))
            np.testing.assert_allclose(self.model.rnea(q, v, a), self.model.mass_matrix(q) @ a + bias, atol=1e-10)
            np.testing.assert_allclose(self.model.rnea(q, 0 * v, 0 * a), self.model.gravity(q), atol=1e-12)

    def test_RandomConfigurationsAreWithinLimitsAndRepeatable(self):
        rows = self.model.random_configuration(5, 500)
        self.assertEqual(rows.shape, (500, 8))
        self.assertTrue(((rows >= self.model.lower_limits) & (rows <= self.model.upper_limits)).all())
        self.assertGreater(rows[:, 0].max() - rows[:, 0].min(), 0.9 * (self.model.upper_limits - self.model.lower_limits)[0])
        np.testing.assert_array_equal(self.model.random_configuration(5), rows[0])
        self.assertFalse((self.model.random_configuration(6) == rows[0]).all())
        follower = next(joint for joint in self.model.joints.values() if joint.mimics)
        leader = self.model.joints[follower.mimics]
        np.testing.assert_allclose(rows[:, follower.q_index], follower.multiplier * rows[:, leader.q_index] + follower.offset)

    def test_JointsThatMimicFollowInForwardDynamics(self):
        follower = next(joint for joint in self.model.joints.values() if joint.mimics)
        leader = self.model.joints[follower.mimics]
        random = np.random.default_rng(11)
        q, v, a = self.model.random_configuration(1), random.normal(size=8), random.normal(size=8)
        for rates in (v, a):
            rates[follower.v_index] = follower.multiplier * rates[leader.v_index]
        np.testing.assert_allclose(self.model.forward_dynamics(q, v, self.model.rnea(q, v, a)), a, atol=1e-6)

    def test_FoldedArmCollidesAndStretchedOneDoesNot(self):
        free = self.model.neutral()
        self.assertEqual(self.model.collisions(free), [])
        metres, links = self.model.distance(free)
        self.assertGreater(metres, 0)
        self.assertEqual(self.model.collisions(free, clearance=metres + 1e-4), [links])
        folded = next(q for q in self.model.random_configuration(1, 1000) if self.model.collisions(q))
        self.assertLess(self.model.distance(folded)[0], 1e-3)
        for pair in self.model.collisions(folded):
            self.assertLessEqual(set(pair), set(self.model.links))
        self.assertEqual(doppel.Model.load(PENDULUM).distance(Q), (np.inf, None))

    def test_IkFindsPoseOfConfiguration(self):
        q = self.model.neutral() + 0.3
        X = self.model.fk(q, "tool_link_1")
        found = self.model.ik(X, "tool_link_1", seed=q + 0.05)
        np.testing.assert_allclose(self.model.fk(found, "tool_link_1"), X, atol=5e-6)
        for solution in self.model.ik(X, "tool_link_1", all=True):
            np.testing.assert_allclose(self.model.fk(solution, "tool_link_1"), X, atol=5e-6)
        position = self.model.ik(X[:3, 3], "tool_link_1")
        np.testing.assert_allclose(self.model.fk(position, "tool_link_1")[:3, 3], X[:3, 3], atol=5e-6)

    def test_PartOfNameIsRefusedWithWholeName(self):
        with self.assertRaisesRegex(doppel.InputError, "did you mean 'tool_link_1'"):
            self.model.fk(self.model.neutral(), "tool")

    def test_UnreachablePoseIsRefusedWithNearestConfiguration(self):
        with self.assertRaises(doppel.IkError) as raised:
            self.model.ik([2.0, 0, 0], "tool_link_1")
        self.assertIn("out of reach by 1.6", str(raised.exception))
        reached = self.model.fk(raised.exception.nearest, "tool_link_1")[:3, 3]
        self.assertLess(np.linalg.norm(reached - [2, 0, 0]), 1.7)

    def test_ArgumentsAndOverlayChangeModel(self):
        slow = doppel.Model.load("omarm_one", args={"use_sim": True}, overlay="- set_limit: Revolute 2\n  velocity: 1.0\n")
        self.assertEqual((slow.joints["Revolute 2"].velocity, self.model.joints["Revolute 2"].velocity), (1.0, 5.2))
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "slow.overlay.yaml")
            with open(file, "w", encoding="utf-8") as out:
                out.write("- set_limit: Revolute 3\n  velocity: 2.0\n")
            self.assertEqual(doppel.Model.load("omarm_one", overlay=file).joints["Revolute 3"].velocity, 2.0)
        with doppel.Twin(slow) as twin:  # with its meshes and controllers
            twin.step(10)
            self.assertEqual({one["state"] for one in twin.controllers().values()}, {"active"})
            self.assertFalse([one for one in twin.warnings if one["rule"] == "mesh.missing"])

    def test_CheckFindsWhatVerbFinds(self):
        findings = doppel.Model.load(PENDULUM.replace('<mass value="1.5"/>', '<mass value="-1.5"/>')).check()
        worst = findings[0]
        self.assertEqual(worst["severity"], "error")
        self.assertTrue(all({"rule", "message", "file", "line", "fix", "consequence"} <= set(one) for one in findings))

    def test_DocumentsOfOtherToolsNameRobot(self):
        self.assertIn('<robot name="omarm"', self.model.to_urdf())
        self.assertIn("<mujoco model=", self.model.to_mjcf())
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "omarm.sdf")
            text = self.model.to_sdf(file)
            with open(file, encoding="utf-8") as written:
                self.assertEqual(written.read(), text)
        self.assertEqual(doppel.Model.load(self.model.to_urdf()).nq, 8)


class RotationTest(unittest.TestCase):
    def test_QuaternionsOfBothOrdersGiveRotationBack(self):
        random = np.random.default_rng(3)
        for _ in range(50):
            quaternion = random.normal(size=4)
            quaternion /= np.linalg.norm(quaternion)
            X = doppel.pose([1, 2, 3], quat_wxyz=quaternion)
            np.testing.assert_allclose(doppel.pose([1, 2, 3], quat_wxyz=doppel.quat_wxyz(X)), X, atol=1e-12)
            np.testing.assert_allclose(doppel.pose([1, 2, 3], quat_xyzw=doppel.quat_xyzw(X)), X, atol=1e-12)
            np.testing.assert_allclose(np.roll(doppel.quat_wxyz(X), -1), doppel.quat_xyzw(X))
        np.testing.assert_allclose(doppel.pose([0, 0, 0], rpy=[0.1, 0, 0])[1:3, 1], [math.cos(0.1), math.sin(0.1)])


    def test_NumbersThatAreNoRotationAreRefused(self):
        for request in (lambda: doppel.quat_wxyz([1]), lambda: doppel.quat_xyzw(np.zeros((3, 3))), lambda: doppel.quat_xyzw("turn"),
                        lambda: doppel.pose([1, 2]), lambda: doppel.pose([0, 0, 0], quat_wxyz=[1, 0, 0]),
                        lambda: doppel.pose([0, 0, 0], quat_xyzw=[0, 0, 0, 0]), lambda: doppel.pose([0, 0, 0], rpy=0.1),
                        lambda: doppel.pose([0, 0, 0], rpy=[0, 0, 0], quat_xyzw=[0, 0, 0, 1])):
            with self.assertRaisesRegex(doppel.InputError, r"\[python\.(shape|numbers|pose)\]"):
                request()


class ErrorTest(unittest.TestCase):
    def test_FaultyTextIsRefusedWithEveryPlaceAndFix(self):
        with self.assertRaises(doppel.InputError) as raised:
            doppel.Model.load(PENDULUM.replace('type="fixed"', 'type="fixd"').replace('<parent link="upper"/>', '<parent link="uper"/>'))
        found = {one["rule"]: one for one in raised.exception.diagnostics}
        self.assertEqual(found["urdf.joint_type"]["line"], 12)
        self.assertIn("did you mean 'fixed'", found["urdf.joint_type"]["message"])
        self.assertIn("did you mean 'upper'", found["urdf.unknown_link"]["message"])
        self.assertIn("text:12:", str(raised.exception))
        self.assertEqual(found["urdf.joint_type"]["file"], "text")

    def test_UnknownNamesGetNearestOne(self):
        model = doppel.Model.load(PENDULUM)
        for request in (lambda: model.joints["elbw"], lambda: model.jacobian(Q, "lowr"), lambda: doppel.Model.load("omarm_on"),
                        lambda: model.ik([0, 0, 0], "tp"), lambda: doppel.Twin(model, engine="mujco")):
            with self.assertRaisesRegex(doppel.InputError, "did you mean '(elbow|lower|omarm_one|tip|mujoco)'"):
                request()

    def test_WrongShapesAreRefusedWithBoth(self):
        model = doppel.Model.load(PENDULUM)
        with self.assertRaisesRegex(doppel.InputError, r"q has the shape \[3\], and \[2\] is needed"):
            model.fk([0, 0, 0])
        with self.assertRaisesRegex(doppel.InputError, r"target has the shape \[3, 3\]"):
            model.ik(np.eye(3), "tip")
        with self.assertRaisesRegex(doppel.InputError, "no rotation"):
            model.ik(2 * np.eye(4), "tip")
        for request in (lambda: model.fk("up"), lambda: model.rnea(Q, V, [[1], [2, 3]]),
                        lambda: model.collisions({}), lambda: model.forward_dynamics(Q, V, [1])):
            with self.assertRaisesRegex(doppel.InputError, "(q|a) is .*must be an array of numbers|has the shape"):
                request()


class ImportTest(unittest.TestCase):
    def test_ImportTakesLessThanTenthOfSecondAndNoNumPy(self):
        program = ("import time; t = time.process_time(); import doppel; t = time.process_time() - t; import sys; "
                   "print(t, 'numpy' in sys.modules, '_doppel_tools' in str(sys.modules))")
        runs = [subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
                for _ in range(5)]
        self.assertEqual({tuple(run[1:]) for run in runs}, {("False", "False")})
        self.assertLess(min(float(run[0]) for run in runs), 0.1)


if __name__ == "__main__":
    unittest.main()
