"""The programs of examples/python, as a user starts them, and the snippets of docs/python.md."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["DOPPEL_ROOT"])
PRINTED = {  # what each prints
    "01_check_robots": r"omarm_one +7 joints +1\.28 kg +0 errors",
    "02_step_response": r"rise 10-90 %: 0\.\d+ s, overshoot \d+\.\d %",
    "03_tune_gain": r"settled after 0\.\d\d s",
    "04_camera": r"320 x 240",
    "05_random_rollouts": r"steps per second",
    "06_own_controller": r"within \d{1,2} mrad",
    "07_calibrate": r"off by 0\.0(49|50)\d* rad",
    "08_compare_engines": r"largest difference \d+\.\d+ mrad",
    "09_drive_kate": r"x = 0\.6\d+ m, y = 0\.4\d+ m",
    "10_gymnasium_loop": r"reached (8|9|10) of 10 targets, after 0\.\d+ s",
}
SNIPPET = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


class ExampleTest(unittest.TestCase):
    def test_EveryExampleIsShortAndPrintsItsResult(self):
        files = sorted((ROOT / "examples/python").glob("*.py"))
        self.assertEqual([file.stem for file in files], sorted(PRINTED))
        for file in files:
            with self.subTest(file.name), tempfile.TemporaryDirectory() as folder:
                self.assertLess(len(file.read_text(encoding="utf-8").splitlines()), 30)
                arguments = [ROOT / "robots"] if file.stem == "01_check_robots" else []
                run = subprocess.run([sys.executable, file, *arguments], cwd=folder, capture_output=True, text=True, timeout=120)
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertRegex(run.stdout, PRINTED[file.stem])


class NotebookTest(unittest.TestCase):
    def test_EveryCellRunsAfterCellsBeforeIt(self):
        notebook = json.loads((ROOT / "examples/python/01_check_robots.ipynb").read_text(encoding="utf-8"))
        cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
        self.assertFalse([cell for cell in notebook["cells"] if cell.get("outputs")], "the notebook is kept without outputs")
        run = subprocess.run([sys.executable, "-c", "\n".join(cells)], env={**os.environ, "ROBOTS": str(ROOT / "robots")},
                             capture_output=True, text=True, timeout=120)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertRegex(run.stdout, r"omarm_one +7 joints +1\.28 kg")


class DocumentationTest(unittest.TestCase):
    def test_EverySnippetRunsAfterOnesBeforeIt(self):
        snippets = SNIPPET.findall((ROOT / "docs/python.md").read_text(encoding="utf-8"))
        self.assertGreater(len(snippets), 5)
        with tempfile.TemporaryDirectory() as folder:
            run = subprocess.run([sys.executable, "-c", "\n".join(snippets)], cwd=folder, capture_output=True, text=True, timeout=120)
        self.assertEqual(run.returncode, 0, run.stderr + run.stdout)


if __name__ == "__main__":
    unittest.main()
