#!/usr/bin/env python3
"""examples_test.py EXAMPLES: runs the Python examples and notebooks, and checks what they print."""
import copy
import glob
import importlib.machinery
import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
import types
import unittest

import dtsdf_mapping
from recording_test import FRAMES, write_recording


class Examples(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name

    def run_example(self, name, *arguments):
        environment = dict(os.environ, PYTHONDONTWRITEBYTECODE="1", MPLBACKEND="Agg",
                           MPLCONFIGDIR=self.folder)
        done = subprocess.run([sys.executable, name, *arguments], env=environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                              cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def script(self, name):
        return os.path.join(EXAMPLES, "python", name)

    def test_live(self):
        mesh, saved = self.folder + "/room.ply", self.folder + "/room.dtsdf"
        printed = self.run_example(self.script("02_live.py"), mesh, saved)
        self.assertLess(float(re.search(r"([\d.]+) mm off", printed).group(1)), 4.0)  # voxels: 40 mm
        self.assertGreater(os.path.getsize(mesh), 100000)
        self.assertGreater(os.path.getsize(saved), 100000)
        try:
            import zstandard  # noqa: F401
        except ImportError:
            return
        described = self.run_example(self.script("read_map.py"), saved)
        self.assertIn("voxel size 0.04", described)
        self.assertGreater(int(re.search(r"known voxels (\d+)", described).group(1)), 10000)

    def test_mesh_of_recording(self):
        write_recording(self.folder + "/recording")
        printed = self.run_example(self.script("01_mesh_of_recording.py"), self.folder + "/recording",
                                   self.folder + "/mesh.ply", "0.04")
        self.assertIn(f"{FRAMES - 1} of {FRAMES} images fused", printed)

    def test_found_again(self):
        recording, saved = self.folder + "/recording", self.folder + "/map.dtsdf"
        write_recording(recording)
        mapper = dtsdf_mapping.Mapper("cpu", **{"map/voxel_size_m": 0.04})
        dtsdf_mapping.fuse(mapper, dtsdf_mapping.Recording(recording))
        mapper.save(saved)
        printed = self.run_example(self.script("04_found_again.py"), saved, recording, "3")
        # The scene looks the same from the whole path, so the search must not choose a place.
        self.assertRegex(printed, r"0 of 2 found, 0 elsewhere")

    def test_distances(self):
        printed = self.run_example(self.script("03_distances.py"))
        self.assertRegex(printed, "through the ball: not free")
        self.assertRegex(printed, "around it: free, 100% known")

    def test_mesh_blocks_to_ply_detects_invalid_messages(self):
        """A rostest covers the conversion of valid messages."""
        loader = importlib.machinery.SourceFileLoader("reader", EXAMPLES + "/mesh_blocks_to_ply")
        reader = importlib.util.module_from_spec(importlib.util.spec_from_loader("reader", loader))
        loader.exec_module(reader)
        block = types.SimpleNamespace(origin=[0, 0, 0], positions=[0, 0, 0, 1, 0, 0, 0, 1, 0],
                                      normals=[0] * 6, colours=b"", triangles=[0, 1, 2],
                                      triangles32=[])
        good = types.SimpleNamespace(step_m=0.001, blocks=[block])
        self.assertIsNone(reader.problem_of_message(good))
        for step_m, changed in ((0.001, {"triangles": [0, 1, 3]}), (float("nan"), {}),
                                (0.001, {"normals": [0] * 5}), (0.001, {"positions": [0] * 8}),
                                (0.001, {"origin": [0, -2**63, 0]}),
                                (1e300, {"origin": [0, 0, 2**40]})):
            bad = copy.deepcopy(good)
            bad.step_m = step_m
            vars(bad.blocks[0]).update(changed)
            self.assertIsNotNone(reader.problem_of_message(bad), (step_m, changed))

    def test_every_script_is_tested(self):
        scripts = {os.path.basename(path) for path in glob.glob(self.script("*.py"))}
        self.assertEqual(scripts, {"01_mesh_of_recording.py", "02_live.py", "03_distances.py",
                                   "04_found_again.py", "read_map.py", "simulated_room.py"})

    def test_notebooks(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed")
        notebooks = glob.glob(EXAMPLES + "/notebooks/*.ipynb")
        self.assertGreater(len(notebooks), 0)
        for path in notebooks:
            with open(path, encoding="utf-8") as file:
                cells = json.load(file)["cells"]
            code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
            script = os.path.join(self.folder, "notebook.py")
            with open(script, "w", encoding="utf-8") as file:
                file.write(code.replace('"../python"', repr(EXAMPLES + "/python")))
            printed = self.run_example(script)
            self.assertLess(float(re.search(r"dtsdf_mapping: ([\d.]+) mm", printed).group(1)), 4.0)
            self.assertTrue(os.path.exists(self.folder + "/first_mesh.ply"))
            if "Open3D is not installed" not in printed:
                self.assertLess(float(re.search(r"Open3D: ([\d.]+) mm", printed).group(1)), 10.0)


if __name__ == "__main__":
    EXAMPLES = os.path.realpath(sys.argv.pop(1))
    unittest.main()
