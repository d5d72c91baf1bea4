#!/usr/bin/env python3
"""Shows that check_format.py finds files that are not formatted, and lines that its list has too
many."""
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # the source folder stays as it is

from check_format import find_clang_format, read_list, unformatted, violations  # noqa: E402


class Violations(unittest.TestCase):
    def found(self, paths, listed, bad):
        return list(violations(paths, read_list(listed), lambda files: set(files) & bad))

    def test_each_file_is_formatted_or_listed(self):
        paths = ["src/a.cpp", "src/io/b.cpp"]
        self.assertEqual(self.found(paths, "", set()), [])
        self.assertEqual(len(self.found(paths, "", {"src/a.cpp"})), 1)
        self.assertEqual(self.found(paths, "# why\nsrc/a.cpp\n", {"src/a.cpp"}), [])
        self.assertEqual(self.found(paths, "src/io/\n", {"src/io/b.cpp"}), [])
        self.assertEqual(len(self.found(paths, "src/io\n", {"src/io/b.cpp"})), 2)

    def test_the_list_has_no_line_too_many(self):
        self.assertEqual(len(self.found(["src/a.cpp"], "src/a.cpp\n", set())), 1)
        self.assertEqual(len(self.found(["src/a.cpp"], "src/gone.cpp\n", set())), 1)
        self.assertEqual(self.found(["src/a.cpp"], "src/\n", set()), [])


@unittest.skipIf(find_clang_format() is None, "no clang-format")
class Program(unittest.TestCase):
    def test_clang_format_s_answer_is_understood(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / ".clang-format").write_text("BasedOnStyle: Google\n")
            (root / "good.cpp").write_text("int a = 1;\n")
            (root / "bad.cpp").write_text("int  a=1;\n")
            self.assertEqual(unformatted(find_clang_format(), root, ["good.cpp", "bad.cpp"]),
                             {"bad.cpp"})
            self.assertEqual(unformatted(find_clang_format(), root, []), set())


if __name__ == "__main__":
    sys.exit(unittest.main())
