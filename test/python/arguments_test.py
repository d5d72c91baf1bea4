#!/usr/bin/env python3
"""Tests that errors about wrong arguments say what is expected, and that the map stays unchanged."""
import copy
import pickle
import sys
import unittest

import numpy

import dtsdf_mapping
from room import K, SHAPE, T_W_C, wall


class WrongArguments(unittest.TestCase):
    def setUp(self):
        self.mapper = dtsdf_mapping.Mapper("cpu", threads=1)

    def refuses(self, error, text, *arguments, **keywords):
        with self.assertRaisesRegex(error, text):
            self.mapper.integrate(*arguments, **keywords)
        self.assertEqual(self.mapper.stats["blocks"], 0)

    def test_depth(self):
        self.refuses(TypeError, "uint16.*or float32.*float64", wall().astype(float), K, T_W_C)
        self.refuses(TypeError, "depth: numpy.ndarray", [[1.0]], K, T_W_C)
        self.refuses(TypeError, "uint16.*>f4", wall().astype(">f4"), K, T_W_C)
        self.refuses(ValueError, r"shape \(H, W\).*\(120, 160, 1\)", wall()[..., None], K, T_W_C)
        self.refuses(ValueError, "ascontiguousarray", wall().T, K, T_W_C)
        self.refuses(ValueError, "ascontiguousarray", wall()[::-1], K, T_W_C)
        self.refuses(ValueError, "ascontiguousarray", wall()[:, ::2], K, T_W_C)
        self.refuses(ValueError, "image", numpy.empty((0, 0), numpy.float32), K, T_W_C)
        self.refuses(ValueError, "depth unit", wall(), K, T_W_C, unit_m=-1.0)
        self.refuses(ValueError, "stamp_s", wall(), K, T_W_C, numpy.nan)
        self.refuses(TypeError, "filled", numpy.ma.masked_equal(wall(), 2.0), K, T_W_C)

    def test_rows_may_have_a_stride(self):
        self.assertTrue(self.mapper.integrate(wall()[:, :100], K, T_W_C))

    def test_camera_and_pose(self):
        self.refuses(ValueError, "K must be.*3 x 3", wall(), numpy.eye(4), T_W_C)
        self.refuses(ValueError, "focal", wall(), (0.0, 100.0, 80.0, 60.0), T_W_C)
        self.refuses(ValueError, "K must be.*finite", wall(), (numpy.nan, 100.0, 80.0, 60.0), T_W_C)
        skewed = K.copy()
        skewed[0, 1] = 1.0
        self.refuses(ValueError, "skew", wall(), skewed, T_W_C)
        self.refuses(TypeError, r"T_W_C: numpy.ndarray\[numpy.float64\[4, 4\]", wall(), K, numpy.eye(3))
        self.refuses(ValueError, "pose", wall(), K, T_W_C * numpy.nan)
        self.refuses(ValueError, "not a rotation", wall(), K, numpy.diag([1.0, 1.0, -1.0, 1.0]))
        self.refuses(ValueError, "last row", wall(), K, numpy.diag([1.0, 1.0, 1.0, 2.0]))
        self.refuses(TypeError, "T_W_C", wall(), K, "here")
        far = numpy.eye(4)
        far[0, 3] = 1e9
        self.refuses(ValueError, "", wall(), K, far)

    def test_colour(self):
        for error, colour, encoding in ((TypeError, numpy.zeros(SHAPE + (3,)), ""),
                                        (ValueError, numpy.zeros(SHAPE + (2,), numpy.uint8), ""),
                                        (ValueError, numpy.zeros(SHAPE, numpy.uint8), "rgb8"),
                                        (ValueError, numpy.zeros(SHAPE, numpy.uint8), "yuv")):
            with self.assertRaises(error):
                self.mapper.paint(colour, K, T_W_C, encoding)

    def test_settings(self):
        with self.assertRaises(ValueError) as refused:
            dtsdf_mapping.Mapper("cpu", {"map/voxel_sise_m": 0.1, "threads": -1})
        self.assertIn("map/voxel_size_m", str(refused.exception))
        self.assertIn("threads", str(refused.exception))
        with self.assertRaisesRegex(ValueError, "backend"):
            dtsdf_mapping.Mapper("gpu")
        with self.assertRaisesRegex(ValueError, "map/voxel_size_m.*list"):
            dtsdf_mapping.Mapper("cpu", {"map/voxel_size_m": [0.1]})
        with self.assertRaisesRegex(ValueError, "threads"):
            dtsdf_mapping.Mapper("cpu", threads=10**30)
        with self.assertRaisesRegex(TypeError, "dict or the path"):
            dtsdf_mapping.Mapper("cpu", 3)
        with self.assertRaisesRegex(RuntimeError, "missing.yaml"):
            dtsdf_mapping.Mapper("cpu", "/missing.yaml")

    def test_settings_of_unusual_types(self):
        endless = {}
        endless["map"] = endless
        with self.assertRaisesRegex(ValueError, "[Cc]ircular"):
            dtsdf_mapping.Mapper("cpu", endless)
        with self.assertRaises(TypeError):
            dtsdf_mapping.Mapper("cpu", threads=object())
        for voxel_m in (numpy.float32(0.25), numpy.float64(0.25), 0.25):
            mapper = dtsdf_mapping.Mapper("cpu", {"map": {"voxel_size_m": voxel_m}}, threads=numpy.int64(1),
                                          **{"map/directional": numpy.bool_(False)})
            self.assertEqual(mapper.settings["map/voxel_size_m"], 0.25)
        self.assertRegex(dtsdf_mapping.__version__, r"^\d+\.\d+\.\d+$")

    def test_files(self):
        with self.assertRaisesRegex(RuntimeError, "missing.dtsdf"):
            dtsdf_mapping.Mapper.load("/missing.dtsdf")
        with self.assertRaises(RuntimeError):
            self.mapper.mesh().save("empty.ply")
        for use in (self.mapper.save, self.mapper.mesh().save, dtsdf_mapping.Mapper.load,
                    dtsdf_mapping.Recording):
            with self.assertRaisesRegex(TypeError, "PathLike"):
                use(None)
            with self.assertRaisesRegex(ValueError, "NUL"):
                use("a\0b.ply")
        with self.assertRaisesRegex(RuntimeError, "/missing"):
            dtsdf_mapping.Recording("/missing")

    def test_no_space_and_no_measurement(self):
        with self.assertRaisesRegex(RuntimeError, "space/enabled"):
            _ = self.mapper.space
        result = self.mapper.integrate(wall(0.0), K, T_W_C)
        self.assertFalse(result)
        self.assertIn("measurement", result.status)

    def test_regions_and_points(self):
        with self.assertRaises(ValueError):
            dtsdf_mapping.Sphere((0.0, 0.0, 0.0), -1.0)
        with self.assertRaises(TypeError):
            dtsdf_mapping.Box((1.0, 1.0))
        space = dtsdf_mapping.Mapper("cpu", **{"space/enabled": True}).space
        with self.assertRaisesRegex(TypeError, r"\[m, 3\]"):
            space.states(numpy.zeros((2, 4)))

    def test_pickle_and_copy(self):
        for thing in (self.mapper, self.mapper.mesh(), self.mapper.blocks()):
            with self.assertRaisesRegex(TypeError, "cannot be pickled"):
                pickle.dumps(thing)
            with self.assertRaisesRegex(TypeError, "cannot be pickled"):
                copy.copy(thing)


if __name__ == "__main__":
    sys.exit(unittest.main())
