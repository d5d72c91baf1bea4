#!/usr/bin/env python3
"""What start_rviz makes of the configuration. Needs no ROS."""
import importlib.machinery
import importlib.util
import os
import unittest

import yaml

SOURCE = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
LOADER = importlib.machinery.SourceFileLoader("start_rviz", f"{SOURCE}/scripts/start_rviz")
SPEC = importlib.util.spec_from_loader("start_rviz", LOADER)
start_rviz = importlib.util.module_from_spec(SPEC)
LOADER.exec_module(start_rviz)


class StartRviz(unittest.TestCase):
    def setUp(self):
        with open(f"{SOURCE}/rviz/mapping.rviz", encoding="utf-8") as file:
            self.config = yaml.safe_load(file)

    def adapt(self, *arguments):
        return start_rviz.adapt(self.config, *arguments)["Visualization Manager"]

    def display(self, manager, name):
        return next(d for d in manager["Displays"] if d.get("Name") == name)

    def test_topics_are_those_in_use(self):
        manager = self.adapt("/robot/mapper", "/front/depth/image_raw", "odom", [])
        self.assertEqual(self.display(manager, "Depth")["Image Topic"], "/front/depth/image_raw")
        self.assertEqual(self.display(manager, "Mesh")["Marker Topic"], "/robot/mapper/mesh")
        self.assertEqual(self.display(manager, "Surface points")["Topic"],
                         "/robot/mapper/surface_points")
        self.assertEqual(manager["Global Options"]["Fixed Frame"], "odom")

    def test_the_view_is_where_the_mesh_is(self):
        view = self.adapt("/mapping", "/d", "map", [(1, 2, 3), (3, 2, 3)])["Views"]["Current"]
        self.assertEqual(view["Focal Point"], {"X": 2.0, "Y": 2.0, "Z": 3.0})
        self.assertAlmostEqual(view["Distance"], 2.5)

    def test_without_a_mesh_the_view_stays(self):
        before = dict(self.config["Visualization Manager"]["Views"]["Current"])
        self.assertEqual(self.adapt("/mapping", "/d", "map", [])["Views"]["Current"], before)


if __name__ == "__main__":
    unittest.main()
