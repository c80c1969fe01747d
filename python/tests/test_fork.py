"""A process that os.fork() makes closes its copies of a twin, a client and a model: those of the parent are not affected."""
import gc
import os
import signal
import subprocess
import tempfile
import threading
import unittest
import urllib.request
from unittest import mock

import doppel
from doppel.envs import ReachVectorEnv

OTHER_PROCESS = "belongs? to the process that made"


def run_in_fork(function):
    """The exit code of a child that calls the function: 0, or 1 for an exception, which it prints."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            signal.alarm(120)  # a child that waits for threads which it does not have
            function()
            code = 0
        except BaseException as error:
            print(repr(error), flush=True)
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class ForkTest(unittest.TestCase):
    def assert_refused(self, *requests):
        for request in requests:
            with self.assertRaisesRegex(doppel.InputError, OTHER_PROCESS):
                request()

    def test_OtherCallsOfTwinAreRefusedAndItsArraysStay(self):
        with doppel.Twin("omarm_one") as twin:
            twin.step(10)
            held = twin.q.copy()

            def work():
                self.assertTrue((twin.q == held).all())
                self.assert_refused(twin.step, twin.reset, twin.save, twin.topics, lambda: twin.time, lambda: twin.record("never.mcap"),
                                    lambda: twin.call("/get_entities"), lambda: doppel.rollout(twin, None, held[None, :7]))
                self.assertEqual(repr(twin), "<doppel.Twin, closed>")
                twin.close()
                with doppel.Twin("omarm_one") as another:
                    another.step(10)
                    self.assertTrue((another.q == held).all())
            self.assertEqual(run_in_fork(work), 0)
            twin.step(10)

    def test_TwinThatThreadHoldsIsClosedWithoutWaiting(self):
        with doppel.Twin("omarm_one") as twin:
            stepping = threading.Thread(target=twin.run_for, args=(100.0,))
            stepping.start()
            self.assertEqual(run_in_fork(twin.close), 0)
            stepping.join()

    @unittest.skipUnless("DOPPEL" in os.environ, "DOPPEL names the program")
    def test_RecordingIsCompletedByParentAlone(self):
        with tempfile.TemporaryDirectory() as folder, doppel.Twin("omarm_one") as twin:
            file = os.path.join(folder, "run.mcap")
            recording = twin.record(file)
            joint_states = twin.subscribe("/joint_states", depth=1000)
            twin.run_for(0.1)

            def work():
                joint_states.close()
                self.assertEqual(recording.stop(), 0)
                twin.close()
            self.assertEqual(run_in_fork(work), 0)
            twin.run_for(0.1)
            self.assertGreater(len(joint_states.messages()), 3)
            self.assertGreater(recording.stop(), 0)
            check = subprocess.run([os.environ["DOPPEL"], "bag", "check", file], capture_output=True, text=True, timeout=120)
            self.assertEqual(check.returncode, 0, check.stdout + check.stderr)

    def test_PageStaysServedAndAnnounced(self):
        with tempfile.TemporaryDirectory() as folder, mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder), doppel.Twin("omarm_one") as twin:
            page = twin.view()
            self.assertEqual(run_in_fork(twin.close), 0)
            with urllib.request.urlopen(page.url, timeout=30) as answer:
                self.assertIn(b"<html", answer.read(2000).lower())
            stop = threading.Event()

            def run():
                while not stop.is_set():
                    twin.run_for(0.05, speed=5)
            stepping = threading.Thread(target=run)
            stepping.start()
            try:
                with doppel.Client() as client:  # by the announcement in that folder
                    self.assertIn("/joint_states", client.topics())

                    def work():
                        self.assert_refused(client.topics, client.positions)
                        client.close()
                    self.assertEqual(run_in_fork(work), 0)
                    self.assertEqual(len(client.positions()), 7)
            finally:
                stop.set()
                stepping.join()

    def test_FilesOfModelStayForParent(self):
        models = [doppel.Model.load("omarm_one", overlay="- set_limit: Revolute 2\n  velocity: 1.0\n")]

        def work():
            models.clear()
            gc.collect()
        self.assertEqual(run_in_fork(work), 0)
        with doppel.Twin(models[0]) as twin:
            twin.step()

    def test_VectorOfEnvironmentsIsRefusedAndClosed(self):
        envs = ReachVectorEnv(2, model="omarm_one", threads=2)
        envs.reset(seed=1)

        def work():
            self.assert_refused(lambda: envs.reset(seed=1), lambda: envs.step(envs.action_space.sample()))
            envs.close()
        self.assertEqual(run_in_fork(work), 0)
        envs.step(envs.action_space.sample())
        envs.close()


if __name__ == "__main__":
    unittest.main()
