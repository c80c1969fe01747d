"""Loads and checks every robot of a folder; prints one line for each: python3 01_check_robots.py [FOLDER]"""
import pathlib
import sys

import doppel

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "robots")
for robot in sorted(path for path in folder.iterdir() if path.is_dir()):
    try:
        model = doppel.Model.load(robot)
    except doppel.InputError as error:
        print(f"{robot.name:16} {error.diagnostics[0]['message']}")
        continue
    found = [finding["severity"] for finding in model.check()]
    print(f"{robot.name:16} {len(model.driven):3} joints {model.mass:8.2f} kg   "
          f"{found.count('error')} errors, {found.count('warning')} warnings")
