#!/usr/bin/env python3
"""Tests how start_rviz adapts the RViz configuration. Does not need ROS."""
import importlib.machinery
import importlib.util
import os
import sys
import tempfile
import types
import unittest
import unittest.mock

import yaml

SOURCE = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
LOADER = importlib.machinery.SourceFileLoader("start_rviz", f"{SOURCE}/scripts/start_rviz")
SPEC = importlib.util.spec_from_loader("start_rviz", LOADER)
start_rviz = importlib.util.module_from_spec(SPEC)
LOADER.exec_module(start_rviz)


class StartRviz(unittest.TestCase):
    def setUp(self):
        self.config = self.read("markers")

    def read(self, display):
        name = start_rviz.config_of(f"{SOURCE}/rviz", display)
        with open(name, encoding="utf-8") as file:
            return yaml.safe_load(file)

    def adapt(self, *arguments):
        return start_rviz.adapt(self.config, *arguments)["Visualization Manager"]

    def display(self, manager, name):
        return next(d for d in manager["Displays"] if d.get("Name") == name)

    def test_topics_are_those_in_use(self):
        manager = self.adapt("/robot/mapper", "/front/depth/image_raw", "compressedDepth", "odom", [])
        self.assertEqual(self.display(manager, "Depth")["Image Topic"], "/front/depth/image_raw")
        self.assertEqual(self.display(manager, "Mesh")["Marker Topic"], "/robot/mapper/mesh")
        self.assertEqual(self.display(manager, "Surface points")["Topic"],
                         "/robot/mapper/surface_points")
        self.assertEqual(manager["Global Options"]["Fixed Frame"], "odom")
        self.assertNotEqual(self.display(manager, "Depth")["Enabled"], False)
        manager = self.adapt("/mapping", "/points", "cloud", "odom", [])
        self.assertEqual(self.display(manager, "Depth")["Enabled"], False)

    def test_each_display_has_its_own_configuration(self):
        self.config = self.read("blocks")
        mesh = self.display(self.adapt("/robot/mapper", "/d", "raw", "odom", []), "Mesh")
        self.assertEqual(mesh["Class"], "dtsdf_mapping/MeshBlocks")
        self.assertEqual(mesh["Topic"], "/robot/mapper/mesh_blocks")
        self.assertEqual(start_rviz.config_of(__file__, "blocks"), __file__)

    def test_configurations_differ_only_in_the_mesh(self):
        def others(config):
            return [d for d in config["Visualization Manager"].pop("Displays")
                    if d.get("Name") != "Mesh"], config
        self.assertEqual(others(self.read("markers")), others(self.read("blocks")))

    def test_the_library_of_the_display_is_found(self):
        with tempfile.TemporaryDirectory() as prefix:
            os.mkdir(f"{prefix}/lib")
            for environment in ({"CMAKE_PREFIX_PATH": f"/nowhere:{prefix}"},
                                {"LD_LIBRARY_PATH": f"{prefix}/lib"}):
                library = f"{prefix}/lib/libdtsdf_mapping_rviz.so"
                self.assertFalse(start_rviz.display_is_built(environment))
                open(library, "w", encoding="utf-8").close()
                self.assertTrue(start_rviz.display_is_built(environment))
                os.remove(library)

    def test_corners_of_a_block(self):
        block = types.SimpleNamespace(origin=[1000, -1000, 0], positions=[0, 0, 0, 8, 2, 4])
        message = types.SimpleNamespace(blocks=[block], step_m=0.5)
        self.assertEqual(start_rviz.points_of(message), [(500.0, -500.0, 0.0), (504.0, -499.0, 2.0)])

    def test_waits_for_triangles(self):
        """The first message to a new subscriber contains no triangles."""
        def message(*points):
            header = types.SimpleNamespace(frame_id="level")
            return types.SimpleNamespace(markers=[types.SimpleNamespace(header=header, points=list(points))])

        def subscribe(topic, _, callback):
            self.assertEqual(topic, "/mapping/mesh")
            callback(message())
            callback(message(types.SimpleNamespace(x=1.0, y=2.0, z=3.0)))
            return types.SimpleNamespace(unregister=lambda: None)
        rospy = types.SimpleNamespace(Subscriber=subscribe, is_shutdown=lambda: False)
        messages = types.SimpleNamespace(MarkerArray=object)
        with unittest.mock.patch.dict(sys.modules, {"visualization_msgs": messages, "visualization_msgs.msg": messages}):
            self.assertEqual(start_rviz.wait_for_mesh(rospy, "/mapping", "markers", 1.0),
                             ("level", [(1.0, 2.0, 3.0)]))

    def test_the_view_centres_on_the_mesh(self):
        view = self.adapt("/mapping", "/d", "raw", "map", [(1, 2, 3), (3, 2, 3)])["Views"]["Current"]
        self.assertEqual(view["Focal Point"], {"X": 2.0, "Y": 2.0, "Z": 3.0})
        self.assertAlmostEqual(view["Distance"], 2.5)

    def test_the_view_stays_without_a_mesh(self):
        before = dict(self.config["Visualization Manager"]["Views"]["Current"])
        self.assertEqual(self.adapt("/mapping", "/d", "raw", "map", [])["Views"]["Current"], before)


if __name__ == "__main__":
    unittest.main()
