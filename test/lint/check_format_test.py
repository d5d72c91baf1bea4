#!/usr/bin/env python3
"""Shows that check_format.py finds files that are not formatted."""
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # the source folder stays as it is

from check_format import find_clang_format, unformatted  # noqa: E402


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
