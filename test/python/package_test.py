#!/usr/bin/env python3
"""package_test.py [--messages]: checks that the package on sys.path is complete: it can map, is documented,
has stubs that match the compiled part, and with --messages contains the generated messages."""
import ast
import inspect
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import dtsdf_mapping
from dtsdf_mapping import _core
from room import map_of_wall

WITH_MESSAGES = "--messages" in sys.argv
FOLDER = os.path.dirname(dtsdf_mapping.__file__)


def names_of(body):
    """{name: names of its members, or None for a function} of a part of a stub."""
    names = {}
    for node in body:
        if isinstance(node, ast.ClassDef):
            names[node.name] = set(names_of(node.body))
        elif isinstance(node, ast.FunctionDef):
            names[node.name] = None
    return names


def public(names):
    return {name for name in names if not name.startswith("_") or name == "__init__"}


class Package(unittest.TestCase):
    def test_it_maps(self):
        self.assertGreater(len(map_of_wall(dtsdf_mapping).mesh().triangles), 1000)

    def test_everything_is_exported_and_documented(self):
        self.assertIn("Mapper", dtsdf_mapping.__all__)
        for name in dtsdf_mapping.__all__:
            value = getattr(dtsdf_mapping, name)
            self.assertTrue(inspect.getdoc(value), name)
            for member in public(vars(value)) if inspect.isclass(value) else ():
                self.assertTrue(inspect.getdoc(getattr(value, member)), f"{name}.{member}")

    def test_stubs_match_the_compiled_part(self):
        with open(os.path.join(FOLDER, "_core.pyi"), encoding="utf-8") as file:
            stubs = names_of(ast.parse(file.read()).body)
        self.assertEqual(public(stubs), public(vars(_core)))
        for name, members in stubs.items():
            if members is None:
                continue
            there = public(vars(getattr(_core, name)))
            made = {"__init__"} if "__init__" not in members else set()
            self.assertEqual(public(members) | made, there | {"__init__"}, name)

    def test_a_missing_compiled_part_is_reported(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(FOLDER, folder + "/dtsdf_mapping", ignore=shutil.ignore_patterns("_core.*.so"))
            run = subprocess.run([sys.executable, "-BS", "-c", "from dtsdf_mapping import *\n"
                                  "import dtsdf_mapping\nprint('imported')\ndtsdf_mapping.Mapper"],
                                 env=dict(os.environ, PYTHONPATH=folder), stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, text=True, check=False)
        self.assertEqual(run.stdout.count("imported"), 1, run.stdout)
        self.assertIn("ImportError: only the messages of dtsdf_mapping are available", run.stdout)
        self.assertIn("WITH_PYTHON=ON", run.stdout)

    @unittest.skipUnless(WITH_MESSAGES, "built without ROS")
    def test_the_package_contains_the_messages(self):
        from dtsdf_mapping.msg import MapStatus
        from dtsdf_mapping.srv import SaveMesh
        self.assertEqual(MapStatus._type, "dtsdf_mapping/MapStatus")
        self.assertEqual(SaveMesh._type, "dtsdf_mapping/SaveMesh")


if __name__ == "__main__":
    unittest.main(argv=[argument for argument in sys.argv if argument != "--messages"])
