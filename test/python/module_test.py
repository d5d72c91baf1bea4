#!/usr/bin/env python3
"""Tests the Python module: analytic scenes, processes, threads and leaks."""
import gc
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
import unittest

import numpy

import dtsdf_mapping
from room import K, SHAPE, T_W_C, map_of_wall, wall


def resident_bytes():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Meshes(unittest.TestCase):
    def test_a_wall_is_meshed_in_place(self):
        mesh = map_of_wall(dtsdf_mapping).mesh()
        self.assertGreater(len(mesh.triangles), 1000)
        numpy.testing.assert_allclose(mesh.vertices[:, 2], 2.0, atol=0.002)
        numpy.testing.assert_allclose(numpy.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)
        self.assertLess(mesh.normals[:, 2].max(), -0.9)  # towards the camera
        self.assertLess(mesh.triangles.max(), len(mesh.vertices))
        self.assertIsNone(mesh.colours)

    def test_whole_millimetres_and_metres_give_the_same_mesh(self):
        mapper = dtsdf_mapping.Mapper("cpu", {"map": {"voxel_size_m": 0.04}})
        depth = numpy.full(SHAPE, 2000, numpy.uint16)
        for _ in range(3):
            self.assertTrue(mapper.integrate(depth, (130.0, 130.0, 79.5, 59.5), T_W_C).fused)
        expected = map_of_wall(dtsdf_mapping).mesh()
        numpy.testing.assert_allclose(mapper.mesh().vertices, expected.vertices, atol=1e-5)

    def test_arrays_are_views_that_outlive_the_mesh(self):
        mesh = map_of_wall(dtsdf_mapping).mesh()
        vertices = mesh.vertices
        self.assertEqual(vertices.ctypes.data, mesh.vertices.ctypes.data)
        self.assertFalse(vertices.flags.writeable)
        expected = vertices.copy()
        del mesh
        gc.collect()
        _ = [numpy.zeros(expected.shape, numpy.float32) for _ in range(50)]
        numpy.testing.assert_array_equal(vertices, expected)

    def test_colour_reaches_the_vertices(self):
        mapper = map_of_wall(dtsdf_mapping)
        colour = numpy.empty(SHAPE + (3,), numpy.uint8)
        colour[:] = (200, 100, 50)
        self.assertTrue(mapper.paint(colour, K, T_W_C))
        mesh = mapper.mesh()
        self.assertGreater(mesh.painted.mean(), 0.8)
        numpy.testing.assert_allclose(numpy.median(mesh.colours[mesh.painted], axis=0),
                                      (200, 100, 50), atol=3)
        swapped = map_of_wall(dtsdf_mapping)
        swapped.paint(colour[..., ::-1].copy(), K, T_W_C, encoding="bgr8")
        numpy.testing.assert_array_equal(swapped.mesh().colours, mesh.colours)

    def test_a_part_of_the_mesh(self):
        mapper = map_of_wall(dtsdf_mapping)
        pose = numpy.eye(4)
        pose[:3, 3] = (0.0, 0.0, 2.0)
        part = mapper.mesh(dtsdf_mapping.Box((0.4, 0.4, 0.4), pose))
        self.assertGreater(len(part.triangles), 10)
        self.assertLessEqual(abs(part.vertices[:, :2]).max(), 0.2001)

    def test_simplified(self):
        mesh = map_of_wall(dtsdf_mapping).mesh()
        simple, error_m = mesh.simplify(0.01)
        self.assertLess(len(simple.triangles), len(mesh.triangles) / 2)
        self.assertLessEqual(error_m, 0.01)


class Maps(unittest.TestCase):
    def test_saved_and_resumed(self):
        with tempfile.TemporaryDirectory() as folder:
            mapper, path = map_of_wall(dtsdf_mapping), os.path.join(folder, "wall.dtsdf")
            saved = mapper.save(path)
            resumed = dtsdf_mapping.Mapper.load(path, "cpu")
            self.assertAlmostEqual(resumed.settings["map/voxel_size_m"], 0.04)
            numpy.testing.assert_array_equal(resumed.mesh().vertices, mapper.mesh().vertices)
            for each in (mapper, resumed):
                each.integrate(wall(), K, T_W_C)
            again = [each.save(path)["content_hash"] for each in (mapper, resumed)]
            self.assertEqual(again[0], again[1])
            self.assertNotEqual(again[0], saved["content_hash"])
            with self.assertRaisesRegex(RuntimeError, "voxel_size_m"):
                dtsdf_mapping.Mapper.load(path, "cpu", **{"map/voxel_size_m": 0.02})

    def test_cleared(self):
        mapper = map_of_wall(dtsdf_mapping)
        self.assertEqual(mapper.clear_region(dtsdf_mapping.Sphere((0.0, 0.0, -5.0), 1.0)), 0)
        self.assertGreater(mapper.clear_region(dtsdf_mapping.Sphere((0.0, 0.0, 2.0), 0.3)), 100)
        radius_m = numpy.linalg.norm(mapper.mesh().vertices - (0.0, 0.0, 2.0), axis=1)
        self.assertGreater(radius_m.min(), 0.2)
        mapper.clear()
        self.assertEqual(len(mapper.mesh().triangles), 0)
        self.assertEqual(mapper.stats["blocks"], 0)

    def test_rendered(self):
        mapper = map_of_wall(dtsdf_mapping)
        depth_m, normals, colours = mapper.render(K, T_W_C, 80, 60)
        self.assertEqual((depth_m.shape, normals.shape, colours), ((60, 80), (60, 80, 3), None))
        seen = depth_m > 0.0
        self.assertGreater(seen.mean(), 0.5)
        self.assertLess(abs(depth_m[seen] - 2.0).max(), 0.004)
        self.assertLess(normals[seen][:, 2].max(), -0.99)
        with self.assertRaisesRegex(ValueError, "empty"):
            mapper.render(K, T_W_C, 0, 60)

    def test_a_camera_is_located(self):
        u, v = numpy.meshgrid(numpy.arange(160), numpy.arange(120))
        relief = (2.0 + 0.3 * numpy.sin(u / 23.0) * numpy.cos(v / 31.0 + u / 60.0)
                  + 0.004 * u).astype(numpy.float32)
        mapper = dtsdf_mapping.Mapper("cpu", **{"map/voxel_size_m": 0.04})
        for _ in range(3):
            mapper.integrate(relief, K, T_W_C)
        found = mapper.locate(relief, K)
        self.assertEqual(found["status"], "aligned")
        self.assertLess(abs(found["T_W_C"] - T_W_C).max(), 0.02)
        self.assertGreater(found["explained"], 0.9)
        self.assertIsNone(found["other_T_W_C"])
        self.assertIsNone(dtsdf_mapping.Mapper("cpu").locate(relief, K)["T_W_C"])

    def test_blocks_hold_the_distance_to_the_wall(self):
        blocks = map_of_wall(dtsdf_mapping).blocks()
        known = blocks.weight > 0.0
        array, z, _, _ = numpy.nonzero(known)
        voxel_z_m = (8 * blocks.keys[blocks.block_of[array], 2] + z) * blocks.voxel_size_m
        toward = blocks.direction[array] == 5  # Z-, facing the camera
        self.assertGreater(toward.sum(), 1000)
        expected = numpy.clip(2.0 - voxel_z_m, -0.16, 0.16)
        error = abs(blocks.distance_m[known] - expected)[toward]
        self.assertLess(numpy.median(error), 0.002)
        self.assertGreater(blocks.evidence[known].max(), 1)
        words = blocks.words[known]
        numpy.testing.assert_allclose((words >> numpy.uint64(40)) / 65536.0, blocks.weight[known],
                                      rtol=1e-6)

    def test_space(self):
        mapper = map_of_wall(dtsdf_mapping, **{"space/enabled": True})
        mapper.space.update()
        points = numpy.array([(0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.0, 0.0, 3.0),
                              (numpy.nan, 0.0, 0.0), (1e12, 0.0, 0.0)])
        numpy.testing.assert_array_equal(mapper.space.states(points), [1, 2, 0, 0, 0])
        known, distance_m, gradient = mapper.space.query(points)
        numpy.testing.assert_array_equal(known, [True, True, False, False, False])
        self.assertAlmostEqual(distance_m[0], 1.0, delta=1.5 * mapper.space.cell_size_m)
        self.assertLess(gradient[0, 2], -0.9)  # distances grow towards the camera
        self.assertLess(distance_m[2], 0.0)
        cells, states = mapper.space.cells()
        self.assertEqual(len(cells), len(states))
        self.assertEqual(set(states), {1, 2})
        space = mapper.space
        del mapper
        gc.collect()
        self.assertEqual(space.states(points)[0], 1)

    def test_settings_from_a_file(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            # The node's settings files may be used; a misspelt key is still an error.
            file.write("map:\n  voxel_size_m: 0.05\nposes:\n  mode: refine\n")
            file.flush()
            mapper = dtsdf_mapping.Mapper("cpu", file.name, **{"mesh/min_support": 1,
                                                                "space/enabled": numpy.bool_(True)})
            file.write("mpa:\n  voxel_size_m: 0.05\n")
            file.flush()
            with self.assertRaisesRegex(ValueError, "mpa/voxel_size_m"):
                dtsdf_mapping.Mapper("cpu", file.name)
        self.assertAlmostEqual(mapper.settings["map/voxel_size_m"], 0.05)
        self.assertEqual(mapper.settings["mesh/min_support"], 1)
        tests = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        dtsdf_mapping.Mapper("cpu", os.path.join(tests, "..", "config", "default.yaml"))
        self.assertIs(mapper.settings["space/enabled"], True)


def _use_in_child(mapper, answers):
    for use in (lambda: mapper.integrate(wall(), K, T_W_C), lambda: dtsdf_mapping.Mapper("cpu")):
        try:
            use()
            answers.put("no error")
        except RuntimeError as error:
            answers.put(str(error))


class Processes(unittest.TestCase):
    def test_a_forked_mapper_is_refused(self):
        context = multiprocessing.get_context("fork")
        answers = context.Queue()
        child = context.Process(target=_use_in_child, args=(map_of_wall(dtsdf_mapping), answers))
        child.start()
        for _ in range(2):
            self.assertIn("spawn", answers.get(timeout=60))
        child.join(60)
        self.assertEqual(child.exitcode, 0)

    def test_ctrl_c_ends_a_loop_of_frames(self):
        mapper = dtsdf_mapping.Mapper("cpu", threads=1)
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        with self.assertRaises(KeyboardInterrupt):
            timer.start()
            for _ in range(100000):
                mapper.integrate(wall(), K, T_W_C)
        self.assertTrue(mapper.integrate(wall(), K, T_W_C))

    def test_other_threads_run_while_it_works(self):
        mapper, busy = dtsdf_mapping.Mapper("cpu", threads=1), threading.Event()
        big = numpy.full((1080, 1920), 2.0, numpy.float32)

        def work():
            busy.set()
            mapper.integrate(big, (1500.0, 1500.0, 960.0, 540.0), T_W_C)
            busy.clear()

        thread = threading.Thread(target=work)
        thread.start()
        busy.wait(60)
        steps = 0
        while busy.is_set():
            steps += 1
            time.sleep(0)
        thread.join()
        self.assertGreater(steps, 100)  # with the GIL held, only a few

    def test_eight_threads_share_a_mapper(self):
        mapper = dtsdf_mapping.Mapper("cpu", **{"map/voxel_size_m": 0.04, "threads": 1})

        def work():
            mapper.integrate(wall(), K, T_W_C)
            mapper.mesh()

        threads = [threading.Thread(target=work) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(mapper.mesh().vertices.tobytes(),
                         map_of_wall(dtsdf_mapping, 8).mesh().vertices.tobytes())


class Memory(unittest.TestCase):
    def assert_flat(self, action):
        for _ in range(100):
            action()
        before = resident_bytes()
        for _ in range(1000):
            action()
        grown = resident_bytes() - before
        # A single leaked mapper is more than 1 MB; a thousand would be gigabytes.
        self.assertLess(grown, 20e6, f"memory use grew by {grown / 1e6} MB in 1000 calls")

    def test_a_thousand_mappers_leak_nothing(self):
        self.assert_flat(lambda: map_of_wall(dtsdf_mapping, 1, **{"mesh/min_support": 1}).mesh())


if __name__ == "__main__":
    sys.exit(unittest.main())
