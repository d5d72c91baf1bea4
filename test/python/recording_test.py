#!/usr/bin/env python3
"""recording_test.py RECONSTRUCT: tests that Python and `reconstruct` build the same map from a recording."""
import os
import subprocess
import sys
import tempfile
import unittest

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import tum_folder

import dtsdf_mapping
from room import K, SHAPE

FRAMES = 6


def write_png(path, image):
    """Writes an image, (H, W) uint16 or (H, W, 3) uint8."""
    grey = image.ndim == 2
    with open(path, "wb") as file:
        file.write(tum_folder.png([row.tobytes() for row in image.astype(">u2" if grey else "u1")],
                                 *((16, 1) if grey else (8, 3))))


def write_recording(folder):
    """Writes a TUM folder with colour: a camera moves along x in front of a tilted floor and a wall. The
    last depth image has no pose."""
    os.makedirs(folder + "/depth")
    os.makedirs(folder + "/rgb")
    with open(folder + "/camera_info.yaml", "w", encoding="ascii") as file:
        file.write(f"image_width: {SHAPE[1]}\nimage_height: {SHAPE[0]}\ncamera_matrix:\n  rows: 3\n"
                   f"  cols: 3\n  data: {[float(x) for x in K.ravel()]}\n")
    v = (numpy.arange(SHAPE[0])[:, None] - K[1, 2]) / K[1, 1] + numpy.zeros(SHAPE)
    depth_m = numpy.minimum(2.0, 1.0 / numpy.maximum(v + 0.3, 1e-6))
    lists = {name: open(f"{folder}/{name}.txt", "w", encoding="ascii")
             for name in ("depth", "rgb", "groundtruth")}
    for i in range(FRAMES):
        stamp = 100.0 + 0.1 * i
        write_png(f"{folder}/depth/{i}.png", numpy.round(depth_m * 5000.0).astype(numpy.uint16))
        colour = numpy.full(SHAPE + (3,), (30 * i, 200, 255 - 30 * i), numpy.uint8)
        write_png(f"{folder}/rgb/{i}.png", colour)
        lists["depth"].write(f"{stamp:.6f} depth/{i}.png\n")
        lists["rgb"].write(f"{stamp + 0.03:.6f} rgb/{i}.png\n")
        if i < FRAMES - 1:
            lists["groundtruth"].write(f"{stamp:.6f} {0.05 * i} 0 0 0 0 0 1\n")
            lists["groundtruth"].write(f"{stamp + 0.03:.6f} {0.05 * i + 0.015} 0 0 0 0 0 1\n")
    for file in lists.values():
        file.close()


class Recordings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name + "/room"
        write_recording(cls.folder)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def made_by_reconstruct(self, *options):
        out = self.scratch.name + "/expected"
        subprocess.run([RECONSTRUCT, "--tum", self.folder, "--backend", "cpu", "--poses-mode", "tf", "--mesh", out + ".ply",
                        "--save-map", out + ".dtsdf", "--set", "map/voxel_size_m=0.03", *options],
                       check=True, stdout=subprocess.DEVNULL)
        return self.bytes_of(out + ".ply"), dtsdf_mapping.Mapper.load(out + ".dtsdf", "cpu")

    @staticmethod
    def bytes_of(path):
        with open(path, "rb") as file:
            return file.read()

    def assert_same_as_reconstruct(self, recording, options, **arguments):
        mapper = dtsdf_mapping.Mapper("cpu", {"map/voxel_size_m": 0.03})
        fused = dtsdf_mapping.fuse(mapper, recording, **arguments)
        path = self.scratch.name + "/found.ply"
        mapper.mesh().save(path)
        mesh, resumed = self.made_by_reconstruct(*options)
        self.assertEqual(self.bytes_of(path), mesh)
        found = mapper.save(self.scratch.name + "/found.dtsdf")
        expected = resumed.save(self.scratch.name + "/again.dtsdf")
        self.assertEqual(found["content_hash"], expected["content_hash"])
        return fused

    def test_gives_the_same_bytes_as_reconstruct(self):
        recording = dtsdf_mapping.Recording(self.folder)
        self.assertEqual(len(recording), FRAMES)
        self.assertEqual(self.assert_same_as_reconstruct(recording, ()), FRAMES - 1)
        self.assertEqual(sum(recording.skipped.values()), 1)  # no pose

    def test_a_selection_without_colour(self):
        recording = dtsdf_mapping.Recording(self.folder, first=1, last=4, step=2)
        fused = self.assert_same_as_reconstruct(
            recording, ("--frames", "1:4:2", "--set", "colour/enabled=false"), colour=False)
        self.assertEqual(fused, 2)

    def test_images_are_as_they_were_written(self):
        first = next(iter(dtsdf_mapping.Recording(self.folder)))
        self.assertEqual(first.depth.dtype, numpy.uint16)
        self.assertAlmostEqual(float(first.depth[0, 0]) * first.unit_m, 2.0, places=4)
        self.assertEqual((first.index, first.stamp_s), (0, 100.0))
        numpy.testing.assert_allclose(first.K, K)
        last = list(dtsdf_mapping.Recording(self.folder))[-1]
        self.assertAlmostEqual(last.T_W_C[0, 3], 0.05 * (FRAMES - 2))
        depth = first.depth
        del first
        self.assertAlmostEqual(float(depth[0, 0]), 10000.0)  # the array keeps its memory alive
        colours = list(dtsdf_mapping.Recording(self.folder).colours())
        self.assertEqual(len(colours), FRAMES - 1)
        painted = colours[2].colour
        order = [0, 1, 2] if colours[2].encoding.startswith("rgb") else [2, 1, 0]
        numpy.testing.assert_array_equal(painted[5, 7, order], (60, 200, 195))

    def test_progress_counts_and_may_stop(self):
        mapper, calls = dtsdf_mapping.Mapper("cpu"), []
        dtsdf_mapping.fuse(mapper, dtsdf_mapping.Recording(self.folder),
                           progress=lambda done, total: calls.append((done, total)))
        self.assertEqual(calls, [(i + 1, FRAMES) for i in range(FRAMES - 1)])

        def stop(done, total):
            raise StopIteration if done == 2 else KeyError(done)

        with self.assertRaises(KeyError):
            dtsdf_mapping.fuse(mapper, dtsdf_mapping.Recording(self.folder), progress=stop)

    def test_errors_name_malformed_input(self):
        broken = self.scratch.name + "/broken"
        write_recording(broken)
        with open(broken + "/depth/1.png", "wb") as file:
            file.write(b"no image")
        with self.assertRaisesRegex(RuntimeError, "1.png"):
            list(dtsdf_mapping.Recording(broken))
        with self.assertRaises(ValueError):
            dtsdf_mapping.Recording(self.folder, step=0)
        with self.assertRaisesRegex(RuntimeError, "nosuch"):
            dtsdf_mapping.Recording(self.folder, format="nosuch")


if __name__ == "__main__":
    RECONSTRUCT = os.path.realpath(sys.argv.pop(1))
    unittest.main()
