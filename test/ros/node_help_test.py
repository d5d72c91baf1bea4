#!/usr/bin/env python3
"""Tests that --help works without a ROS master. Usage: node_help_test.py MAPPING_NODE SIMULATED_CAMERA"""
import os
import subprocess
import sys
import unittest

MAPPING_NODE, SIMULATED_CAMERA = sys.argv[1:3]
NOBODY = dict(os.environ, ROS_MASTER_URI="http://localhost:1", ROS_HOSTNAME="localhost")


class NodeHelp(unittest.TestCase):
    def expect_help(self, program, option, *parts):
        done = subprocess.run([program, option], env=NOBODY, timeout=60, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        self.assertTrue(done.stdout.startswith("usage: rosrun dtsdf_mapping "), done.stdout)
        for part in parts:
            self.assertIn(part, done.stdout)

    def test_help_of_the_node(self):
        for option in ("--help", "-h"):
            self.expect_help(MAPPING_NODE, option, "mapping.launch", "\n  _map/voxel_size_m:=0.02\n",
                             "\n  _publish/mesh_rate_hz:=2\n")

    def test_help_of_the_simulated_camera(self):
        self.expect_help(SIMULATED_CAMERA, "--help", "\n  _width_px:=320\n", "\n  _encoding:=",
                         "Topics: depth/image_rect, ")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
