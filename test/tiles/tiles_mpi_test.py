#!/usr/bin/env python3
"""Runs `tiles run` under mpirun, with processes killed and a disk that is full, and compares what
comes out with `reconstruct`: tiles_mpi_test.py --tiles T --reconstruct R --mpirun M"""
import argparse
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import tum_folder

WIDTH, HEIGHT, FOCAL = 160, 120, 120.0
HALF = np.array([3.0, 2.5, 1.3])  # of a room round the origin
OPTIONS = None


def depth_in_room(eye, yaw):
    """Depth in metres of a camera (x right, y down, z forward) that looks level, and its pose."""
    forward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = (((u - (WIDTH - 1) / 2) / FOCAL)[..., None] * right +
            ((v - (HEIGHT - 1) / 2) / FOCAL)[..., None] * down + forward)
    with np.errstate(divide="ignore"):
        to_walls = np.where(rays > 0, (HALF - eye) / rays, (-HALF - eye) / rays)
    return to_walls.min(axis=-1), np.stack([right, down, forward], axis=1)


def quaternion(rotation):
    """x, y, z, w of a rotation with trace above -1, or a half turn nearly so."""
    w = np.sqrt(max(1.0 + np.trace(rotation), 1e-12)) / 2.0
    x = (rotation[2, 1] - rotation[1, 2]) / (4.0 * w)
    y = (rotation[0, 2] - rotation[2, 0]) / (4.0 * w)
    z = (rotation[1, 0] - rotation[0, 1]) / (4.0 * w)
    return np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])


def write_recording(folder, count=20):
    images = []
    for i in range(count):
        yaw = 2.0 * np.pi * (i + 0.37) / count
        eye = np.array([1.2 * np.cos(yaw), 0.9 * np.sin(yaw), 0.1])
        depth_m, rotation = depth_in_room(eye, yaw)
        image = tum_folder.png([row.tobytes() for row in np.round(5000.0 * depth_m).astype(">u2")])
        images.append((f"{i}.0", image, (*eye, *quaternion(rotation))))
    tum_folder.write(folder, images)
    (folder / "camera_info.yaml").write_text(
        f"image_width: {WIDTH}\nimage_height: {HEIGHT}\nprojection_matrix:\n  data: [{FOCAL}, 0, "
        f"{(WIDTH - 1) / 2}, 0, 0, {FOCAL}, {(HEIGHT - 1) / 2}, 0, 0, 0, 1, 0]\n")


def processes_with(words):
    """Ids of the processes whose command line has all of these."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            arguments = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if all(word in arguments for word in words):
            found.append(int(entry.name))
    return found


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        result = condition()
        if result:
            return result
        time.sleep(0.002)
    raise AssertionError("it did not come to that")


class TilesUnderMpirun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="dtsdf_tiles_")
        cls.root = pathlib.Path(cls.scratch.name)
        cls.recording = cls.root / "room"
        write_recording(cls.recording)
        settings = ["--set", "map/voxel_size_m=0.03", "poses/mode=tf", "--backend", "cpu"]
        subprocess.run([OPTIONS.reconstruct, cls.recording, *settings, "--mesh",
                        cls.root / "one.ply", "--save-map", cls.root / "one.dtsdf"], check=True,
                       stdout=subprocess.DEVNULL)
        subprocess.run([OPTIONS.tiles, "plan", cls.recording, *settings, "--tile-m", "2.5", "--out",
                        cls.root / "plan"], check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def setUp(self):
        self.folder = self.root / self.id().split(".")[-1]
        shutil.copytree(self.root / "plan", self.folder)

    def command(self, processes):
        program = [OPTIONS.tiles, "run", self.folder, "--threads", "1", "--mesh",
                   self.folder / "all.ply", "--save-map", self.folder / "all.dtsdf"]
        return [OPTIONS.mpirun, "-n", str(processes), *program]

    def start(self, processes, **more):
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1",
                           OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                           OMPI_MCA_rmaps_base_oversubscribe="1",
                           OMPI_MCA_hwloc_base_binding_policy="none")
        return subprocess.Popen([str(word) for word in self.command(processes)], env=environment,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                stdin=subprocess.DEVNULL, **more)

    def run_tiles(self, processes, **more):
        job = self.start(processes, **more)
        out = job.communicate()[0]
        return job.returncode, out

    def expect_same(self):
        for name, of_one in (("all.ply", "one.ply"), ("all.dtsdf", "one.dtsdf")):
            self.assertTrue((self.folder / name).read_bytes() == (self.root / of_one).read_bytes(),
                            name)

    def report(self):
        return json.loads((self.folder / "report.json").read_text())

    def fusing(self):
        return processes_with(["fuse", str(self.folder)])

    def test_any_number_of_processes_makes_the_same_bytes(self):
        for processes in (1, 2, 3):
            shutil.rmtree(self.folder / "tiles", ignore_errors=True)
            code, out = self.run_tiles(processes)
            self.assertEqual(code, 0, out)
            self.expect_same()
            makers = {tile["process"] for tile in self.report()["tiles"]}
            self.assertLessEqual(makers, set(range(processes)))
            self.assertGreaterEqual(len(makers), min(processes, 2))
            self.assertIn("0 s left", out)

    def test_a_child_that_is_killed_is_tried_again(self):
        job = self.start(2)
        os.kill(wait_for(self.fusing)[0], signal.SIGKILL)
        out = job.communicate()[0]
        self.assertEqual(job.returncode, 0, out)
        self.assertIn("failed (signal 9)", out)
        self.assertIn(2, [tile["attempts"] for tile in self.report()["tiles"]])
        self.expect_same()

    def test_goes_on_where_a_rank_was_killed(self):
        job = self.start(2)
        wait_for(lambda: list((self.folder / "tiles").glob("*.json")))
        ranks = sorted(processes_with(["run", str(self.folder)]))
        ranks = [rank for rank in ranks if rank != job.pid]
        os.kill(ranks[-1], signal.SIGKILL)
        out = job.communicate()[0]
        self.assertNotEqual(job.returncode, 0, out)
        wait_for(lambda: not self.fusing(), 10.0)  # none goes on by itself
        self.assertFalse((self.folder / "all.ply").exists())
        done = {path: path.stat().st_mtime_ns for path in (self.folder / "tiles").glob("*.json")}
        code, out = self.run_tiles(3)
        self.assertEqual(code, 0, out)
        self.assertIn(f"{len(done)} of them done already", out)
        self.assertEqual(done, {path: path.stat().st_mtime_ns for path in done})
        self.expect_same()

    def test_a_tile_that_does_not_fit_on_the_disk_is_named(self):
        def small_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        plan = json.loads((self.folder / "plan.json").read_text())
        sizes = [tile["most_map_bytes"] for tile in plan["tiles"]]
        largest = str(sizes.index(max(sizes)))
        fuse = subprocess.run([OPTIONS.tiles, "fuse", self.folder, largest], text=True,
                              stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                              preexec_fn=small_files, restore_signals=False, check=False)
        self.assertEqual(fuse.returncode, 1, fuse.stderr)
        self.assertIn("cannot write", fuse.stderr)
        status = subprocess.run([OPTIONS.tiles, "status", self.folder], text=True, check=True,
                                stdout=subprocess.PIPE).stdout
        self.assertIn(f"{largest}  failed: cannot write", status)
        code, out = self.run_tiles(2)
        self.assertEqual(code, 0, out)
        self.expect_same()


def main():
    global OPTIONS
    parser = argparse.ArgumentParser()
    for name in ("tiles", "reconstruct", "mpirun"):
        parser.add_argument(f"--{name}", required=True)
    OPTIONS, rest = parser.parse_known_args()
    if not OPTIONS.mpirun:
        print("skipped: MPI is not there")
        return 77
    return 0 if unittest.main(argv=[sys.argv[0], *rest], exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
