#!/usr/bin/env python3
"""Tests of check_text.py: what it finds, and what it lets pass."""
import unittest

from check_text import check


class CheckText(unittest.TestCase):
    def found(self, code, path="src/ros/input/a.cpp"):
        return len(check(path, code))

    def test_names_in_texts(self):
        self.assertEqual(self.found('text = "of \'" + info.distortion_model + "\'";'), 1)
        self.assertEqual(self.found('ROS_WARN_STREAM("of " << image->header.frame_id);'), 1)
        self.assertEqual(self.found('throw Error("\'" +\n  file_name + "\' is wrong");'), 1)

    def test_cleaned_names(self):
        self.assertEqual(self.found('text = "of " + printable(info.distortion_model) + ".";'), 0)
        self.assertEqual(self.found('a << "of " << printable(strip(t.child_frame_id)) << "!";'), 0)

    def test_one_cleaned_of_two(self):
        self.assertEqual(self.found('a << printable(x.frame_id) << " of " << x.encoding;'), 1)

    def test_names_that_are_not_shown(self):
        self.assertEqual(self.found('if (image.encoding == "16UC1") return;'), 0)
        self.assertEqual(self.found('// "of " + info.distortion_model'), 0)

    def test_exceptions(self):
        self.assertEqual(self.found('response.message = error.what();'), 1)
        self.assertEqual(self.found('ROS_ERROR_STREAM(a << error.what());'), 1)
        self.assertEqual(self.found('response.message = errorText(error);'), 0)
        self.assertEqual(self.found('throw std::runtime_error("bag: " + error.what());'), 0)
        self.assertEqual(self.found('f(e.what());', "src/program/run_program.cpp"), 0)


if __name__ == "__main__":
    unittest.main()
