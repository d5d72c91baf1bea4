#!/usr/bin/env python3
"""Tests which topics play_bag plays and how it reports missing topics. Does not need ROS."""
import importlib.machinery
import importlib.util
import os
import subprocess
import sys
import unittest

SOURCE = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
LOADER = importlib.machinery.SourceFileLoader("play_bag", f"{SOURCE}/scripts/play_bag")
SPEC = importlib.util.spec_from_loader("play_bag", LOADER)
play_bag = importlib.util.module_from_spec(SPEC)
LOADER.exec_module(play_bag)

IMAGE, COMPRESSED = play_bag.IMAGE, play_bag.COMPRESSED
INFO, IMU = play_bag.CAMERA_INFO, play_bag.IMU
TF = {"/tf": "tf2_msgs/TFMessage"}
DEPTH = {"/d/image": IMAGE, "/d/camera_info": INFO}
COLOUR = {"/c/image": IMAGE, "/c/camera_info": INFO}
OPTIONS = play_bag.parse(["--depth", "/d/image", "/d/camera_info", "--color", "/c/image",
                          "/c/camera_info", "--imu", "imu/data", "--mask", "/mask"])


class PlayBag(unittest.TestCase):
    def problems(self, types, settings=None, depth=("/d/image",)):
        settings = settings or {}
        wanted = play_bag.topics_of_node(OPTIONS, settings)
        return play_bag.problems_of(types, set(depth), wanted, settings)

    def played(self, types, settings=None):
        return play_bag.topics_to_play(types, play_bag.topics_of_node(OPTIONS, settings or {}))

    def test_only_needed_topics_are_played(self):
        types = {**DEPTH, **COLOUR, **TF, "/scan": "sensor_msgs/LaserScan", "/other": IMAGE}
        self.assertEqual(self.problems(types), [])
        self.assertEqual(set(self.played(types)), {*DEPTH, *COLOUR, *TF})
        never = {"colour": {"enabled": "never"}}
        self.assertEqual(set(self.played(types, never)), {*DEPTH, *TF})
        # YAML reads `off` in a settings file as false.
        self.assertEqual(set(self.played(types, {"colour": {"enabled": False}})), {*DEPTH, *TF})

    def test_required_topics_are_played(self):
        types = {**DEPTH, **TF, "/imu/data": IMU, "/mask": IMAGE}
        self.assertEqual(set(self.played(types)), {*DEPTH, *TF})
        self.assertEqual(set(self.played(types, {"map": {"level": "imu"}})),
                         {*DEPTH, *TF, "/imu/data"})
        self.assertEqual(set(self.played(types, {"input": {"mask": True}})),
                         {*DEPTH, *TF, "/mask"})

    def test_missing_required_topics_are_reported(self):
        types = {**DEPTH, **TF, "/camera/imu": IMU}
        self.assertEqual(self.problems(types, {"map": {"level": "imu"}}), [
            ("WARNING", "the bag has no sensor_msgs/Imu on '/imu/data' (imu:=); it has "
                        "sensor_msgs/Imu on: '/camera/imu'")])
        self.assertIn("on '/mask' (mask:=)", self.problems(types, {"input": {"mask": True}})[0][1])

    def test_several_cameras(self):
        names = [f"/{camera}/{kind}" for camera in ("front", "rear")
                 for kind in ("depth/image_rect", "depth/camera_info")]
        types = {name: INFO if name.endswith("info") else IMAGE for name in names}
        settings = {"cameras": ["front", "rear"]}
        depth = [name for name in names if name.endswith("rect")]
        self.assertEqual(self.problems({**types, **TF}, settings, depth), [])
        self.assertEqual(set(self.played({**types, **TF}, settings)), {*names, *TF})
        del types["/rear/depth/image_rect"]
        self.assertIn("'/rear/depth/image_rect' (cameras:=)",
                      self.problems({**types, **TF}, settings, depth)[0][1])

    def test_compressed_images(self):
        types = {"/d/image/compressedDepth": COMPRESSED, "/d/camera_info": INFO, **TF,
                 "/c/image/compressed": COMPRESSED, "/c/camera_info": INFO}
        depth = ["/d/image/compressedDepth"]
        (depth_level, depth_text), (colour_level, colour_text) = self.problems(types, None, depth)
        self.assertEqual([depth_level, colour_level], ["WARNING", "INFO"])
        self.assertIn("'/d/image' with image_transport:=compressedDepth", depth_text)
        self.assertIn("'/c/image' with color_image_transport:=compressed", colour_text)
        self.assertEqual(self.played(types), [])
        settings = {"image_transport": "compressedDepth", "color_image_transport": "compressed"}
        self.assertEqual(self.problems(types, settings, depth), [])
        self.assertEqual(set(self.played(types, settings)), set(types))
        (_, text), = self.problems({**DEPTH, **TF}, {"image_transport": "compressedDepth"})
        self.assertIn("'/d/image' with image_transport:=raw", text)

    def test_clouds(self):
        types = {"/d/image": play_bag.CLOUD, **TF}
        self.assertIn("'/d/image' with image_transport:=cloud", self.problems(types)[0][1])
        self.assertEqual(self.problems(types, {"image_transport": "cloud"}), [])
        self.assertEqual(set(self.played(types, {"image_transport": "cloud"})), set(types))
        self.assertEqual(self.problems({"/p": play_bag.CLOUD, **DEPTH, **TF}, None,
                                       ["/d/image", "/p"]), [])

    def test_colour_on_another_topic_is_reported(self):
        self.assertEqual(self.problems({**DEPTH, **TF}), [])
        other = {**DEPTH, **TF, "/rgb/image": IMAGE, "/c/camera_info": INFO}
        (level, text), = self.problems(other)
        self.assertEqual(level, "INFO")
        self.assertIn("'/rgb/image'", text)
        always = {"colour": {"enabled": "always"}}
        self.assertEqual(self.problems(other, always), [("WARNING", text)])
        self.assertEqual(self.problems({**DEPTH, **TF}, always)[0][0], "WARNING")

    def test_missing_transforms_are_reported_only_if_needed(self):
        self.assertEqual([level for level, _ in self.problems(DEPTH)], ["WARNING"])
        self.assertEqual(self.problems(DEPTH, {"poses": {"mode": "track"}}), [])

    def test_names_without_a_slash(self):
        self.assertEqual(set(self.played({"d/image": IMAGE, "d/camera_info": INFO,
                                          "tf": "tf/tfMessage"})),
                         {"d/image", "d/camera_info", "tf"})

    def test_stays_after_the_bag_but_ends_on_failure(self):
        def start(command):
            program = f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r}); " \
                      f"from play_bag_test import play_bag; play_bag.play({command!r})"
            return subprocess.Popen([sys.executable, "-B", "-c", program], text=True,
                                    stdout=subprocess.PIPE)
        with start(["sh", "-c", "exit 3"]) as failing:
            self.assertEqual(failing.wait(timeout=60), 3)
        with start(["true"]) as done:
            self.assertIn("the bag has ended", done.stdout.readline())
            self.assertIsNone(done.poll())
            done.terminate()


if __name__ == "__main__":
    unittest.main()
