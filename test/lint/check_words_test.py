#!/usr/bin/env python3
"""check_words.py finds what readers stumble over, and nothing else."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_words  # noqa: E402


class CheckWords(unittest.TestCase):
    def problems(self, name, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            return list(check_words.problems(pathlib.Path(folder)))

    def expect_one(self, part, name, text):
        found = self.problems(name, text)
        self.assertEqual(len(found), 1, found)
        self.assertIn(part, found[0])

    def test_accepts_plain_words(self):
        self.assertEqual(self.problems("docs/ros.md", "There is no map. It is no longer used.\n"), [])
        self.assertEqual(self.problems("src/a.cpp", "// this tells\nint told; f(\"reports\");\n"), [])

    def test_reads_pages_over_the_end_of_a_line(self):
        self.expect_one("docs/ros.md:2: 'tells'", "docs/ros.md", "# A\nwhat the node tells\n")
        self.expect_one("docs/ros.md:1: 'has to be'", "docs/ros.md", "The map has to\nbe level.\n")
        self.expect_one("write: is not a", "README.md", "A folder is no map file.\n")

    def test_finds_what_needs_reading_twice(self):
        self.expect_one("'as many or'", "docs/ros.md", "in two as many or\none less\n")
        self.expect_one("'goes first'", "config/a.yaml", "# the oldest goes first\n")
        self.expect_one("'gives a message'", "docs/ros.md", "Each image gives a message on it.\n")
        self.expect_one("'motion leads'", "docs/ros.md", "near where the last motion leads\n")

    def test_reads_literals_that_are_split(self):
        self.expect_one("src/a.cpp:1: 'goes on'", "src/a.cpp", 'say("mapping goes "\n    "on");\n')
        self.expect_one("srv/A.srv:1", "srv/A.srv", "bool known  # as it is told\n")

    def test_leaves_measurements_alone(self):
        self.assertEqual(self.problems("docs/results/x.md", "it tells\n"), [])

    def test_reads_the_method(self):
        self.expect_one("docs/method.md:1: 'tells'", "docs/method.md", "it tells\n")


if __name__ == "__main__":
    unittest.main()
