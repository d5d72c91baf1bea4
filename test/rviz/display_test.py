#!/usr/bin/env python3
"""Tests the RViz display for mesh_blocks on a virtual screen: the mesh must look the same as with markers, and
all display options must work. Needs the build environment (env.sh). Skipped if a program in NEEDED is
missing."""
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from free_port import free_port

SOURCE = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
PROGRAMS = os.environ["DTSDF_PROGRAMS"]
NEEDED = ("Xvfb", "convert", "roscore")
SKIPPED = 77  # see test/rviz/CMakeLists.txt
TRIANGLES = 30000
BACKGROUND = 48  # grey level in the configuration files


def setUpModule():
    global running, folder
    folder = tempfile.mkdtemp()
    running = []
    os.environ.update(ROS_HOSTNAME="localhost", ROS_HOME=folder, LIBGL_ALWAYS_SOFTWARE="1")
    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    screen = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1280x900x24",
                               "-nolisten", "tcp"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    running.append(screen)
    os.environ["DISPLAY"] = ":" + screen.stdout.readline().strip()
    start("roscore", "-p", str(port))
    deadline = time.monotonic() + 60
    while subprocess.run(["rosnode", "list"], capture_output=True, check=False).returncode != 0:
        assert time.monotonic() < deadline, "the ROS master did not start"
        time.sleep(0.2)
    start(f"{PROGRAMS}/publish_mesh", str(TRIANGLES))


def start(*command):
    running.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))


def tearDownModule():
    for process in reversed(running):
        process.terminate()
        process.wait()
    shutil.rmtree(folder)


def show(config, *options):
    """Renders the mesh in RViz with a configuration. Returns one row with red, green and blue per pixel."""
    path = os.path.join(folder, "picture.png")
    result = subprocess.run(
        [f"{PROGRAMS}/show_mesh", f"{SOURCE}/rviz/{config}.rviz", str(TRIANGLES), "0.1", path, "3", *options],
        capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    pixels = subprocess.run(["convert", path, "-depth", "8", "rgb:-"], capture_output=True,
                            check=True).stdout
    picture = np.frombuffer(pixels, dtype=np.uint8).reshape(-1, 3).astype(int)
    return picture


def shown(picture):
    """Mask of all pixels that do not have the background colour."""
    return np.abs(picture - BACKGROUND).max(axis=1) > 2


class Display(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.blocks = show("mapping_blocks", "Detail=0")

    def test_looks_the_same_as_the_markers(self):
        markers = show("mapping")
        self.assertGreater(shown(markers).mean(), 0.1)
        differs = np.abs(markers - self.blocks).max(axis=1) > 8
        self.assertLess(differs.mean(), 0.001)

    def test_less_detail_looks_the_same(self):
        coarse = show("mapping_blocks", "Detail=2")
        self.assertLess((shown(coarse) != shown(self.blocks)).mean(), 0.005)
        self.assertLess(np.abs(coarse - self.blocks).mean(), 2.0)

    def test_colours(self):
        plain = show("mapping_blocks", "Detail=0", "Colour=Plain")
        np.testing.assert_array_equal(shown(plain), shown(self.blocks))
        grey = plain[shown(plain)]
        self.assertLess((grey.max(axis=1) - grey.min(axis=1)).max(), 3)
        height = show("mapping_blocks", "Detail=0", "Colour=Height")
        self.assertGreater((np.abs(height - self.blocks).max(axis=1) > 8).mean(), 0.1)

    def test_the_wireframe_has_gaps(self):
        wires = show("mapping_blocks", "Detail=0", "Wireframe=true")
        self.assertLess(shown(wires).sum(), 0.95 * shown(self.blocks).sum())
        self.assertGreater(shown(wires).sum(), 0.05 * shown(self.blocks).sum())

    def test_alpha_lets_the_background_through(self):
        half = show("mapping_blocks", "Detail=0", "Alpha=0.5")
        seen = shown(self.blocks)
        expected = (self.blocks[seen] + BACKGROUND) / 2
        self.assertLess(np.abs(half[seen] - expected).mean(), 10.0)

    def test_backfaces_can_be_hidden(self):
        self.assertGreater(shown(show("mapping_blocks", "Pitch=-0.9")).mean(), 0.2)
        below = show("mapping_blocks", "Pitch=-0.9", "Backfaces=false")
        self.assertLess(shown(below).mean(), 0.001)
        above = show("mapping_blocks", "Detail=0", "Backfaces=false")
        self.assertLess((np.abs(above - self.blocks).max(axis=1) > 8).mean(), 0.001)


if __name__ == "__main__":
    missing = [program for program in NEEDED if shutil.which(program) is None]
    if missing:
        print("skipped: missing " + ", ".join(missing))
        sys.exit(SKIPPED)
    unittest.main()
