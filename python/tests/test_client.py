"""Client and view: a twin that one thread steps, seen from outside."""
import fcntl
import os
import signal
import subprocess
import threading
import unittest
import urllib.request

import numpy as np

import doppel


class ClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.twin = doppel.Twin("omarm_one")
        cls.page = cls.twin.view()
        cls.port = cls.page.port
        cls.stop = threading.Event()

        def run():
            while not cls.stop.is_set():
                cls.twin.run_for(0.05, speed=5)
        cls.thread = threading.Thread(target=run)
        cls.thread.start()
        cls.client = doppel.Client(cls.port)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.stop.set()
        cls.thread.join()
        cls.twin.close()

    def test_PageIsServedAndShownInNotebook(self):
        with urllib.request.urlopen(self.page.url, timeout=10) as answer:
            self.assertIn(b"<html", answer.read(2000).lower())
        self.assertIn(f'<iframe src="{self.page.url}"', self.page._repr_html_())
        self.assertEqual(self.twin.view().url, self.page.url)

    def test_ClientSeesTopicsServicesAndNodes(self):
        self.assertEqual(self.client.topics()["/joint_states"], "sensor_msgs/msg/JointState")
        self.assertIn("/controller_manager/list_controllers", self.client.services())
        self.assertIn("/robot_state_publisher", self.client.nodes())

    def test_ClientReadsPositions(self):
        positions = self.client.positions()
        self.assertEqual(len(positions), 7)
        states = self.client.subscribe("/joint_states", depth=3)
        first, second = states.wait(), states.wait()
        self.assertNotEqual(first["header"]["stamp"], second["header"]["stamp"])
        states.close()

    def test_ClientMovesArm(self):
        arm = self.client.controller("arm")
        self.assertEqual(arm.follow([1.0], [np.full(6, 0.8)])["error_code"], 0)
        np.testing.assert_allclose([self.client.positions()[joint] for joint in arm.joints], 0.8, atol=0.02)
        with self.assertRaisesRegex(doppel.ServiceError, "refused"):
            arm.follow([1.0, 0.5], [np.full(6, 0.8), np.full(6, 0.7)])

    def test_ClientSetsParametersAndCallsServices(self):
        node = "/omarm_arm_controller"
        self.client.set_parameter(node, "constraints.goal_time", 3.5)
        self.assertEqual(self.client.parameters(node)["constraints.goal_time"], 3.5)
        states = {one["state"] for one in self.client.call("/controller_manager/list_controllers")["controller"]}
        self.assertEqual(states, {"active"})
        with self.assertRaisesRegex(doppel.ServiceError, "did you mean"):
            self.client.call("/controller_manager/list_controler")
        with self.assertRaises(doppel.ServiceError):
            doppel.Client(1)
        with doppel.Client(self.port) as other:
            pass
        with self.assertRaisesRegex(doppel.InputError, "the client is closed"):
            other.topics()


@unittest.skipUnless("DOPPEL" in os.environ, "DOPPEL names the program")
class NetworkClientTest(unittest.TestCase):
    """Another process, reached through the ROS 2 network."""

    def own_domain(self):
        """A ROS_DOMAIN_ID that no other test on this machine uses, reserved as in tests/own_domain.sh until the test ends."""
        for domain in range(30, 40):
            lock = open(os.path.join(os.environ.get("TMPDIR", "/tmp"), f"doppel-test-domain-{domain}"), "w")
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                lock.close()
                continue
            self.addCleanup(lock.close)
            return str(domain)
        self.fail("every domain of the tests is taken")

    def setUp(self):
        self.domain, before = self.own_domain(), os.environ.get("ROS_DOMAIN_ID")
        self.twin = subprocess.Popen([os.environ["DOPPEL"], "up", "omarm_one", "--headless", "--no-reload", "--domain", self.domain],
                                     stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.twin.stderr.close)
        self.addCleanup(self.twin.wait)
        self.addCleanup(self.twin.send_signal, signal.SIGINT)
        self.addCleanup(lambda: os.environ.pop("ROS_DOMAIN_ID") if before is None else os.environ.update(ROS_DOMAIN_ID=before))
        os.environ["ROS_DOMAIN_ID"] = self.domain
        for line in self.twin.stderr:
            if "ready" in line:
                return
        self.fail("the twin has not started")

    def test_ClientOfNetworkMovesArm(self):
        with doppel.Client(ros=True) as client:
            self.assertEqual(client.topics()["/joint_states"], "sensor_msgs/msg/JointState")
            arm = client.controller("arm")
            self.assertEqual(arm.follow([1.0], [np.full(6, 0.8)])["error_code"], 0)
            np.testing.assert_allclose([client.positions()[joint] for joint in arm.joints], 0.8, atol=0.02)
            client.set_parameter("/omarm_arm_controller", "constraints.goal_time", 3.5)
            self.assertEqual(client.parameters("/omarm_arm_controller")["constraints.goal_time"], 3.5)
            with self.assertRaisesRegex(doppel.ServiceError, "did you mean '/joint_states'"):
                client.subscribe("/joint_state")


class InterruptTest(unittest.TestCase):
    def test_SignalEndsLongStep(self):
        with doppel.Twin("omarm_one") as twin:
            threading.Timer(0.3, lambda: signal.raise_signal(signal.SIGINT)).start()
            with self.assertRaises(KeyboardInterrupt):
                twin.step(10**9)
            self.assertLess(twin.time, 1000)


if __name__ == "__main__":
    unittest.main()
