#!/usr/bin/env python3
"""Shows that check_layers.py finds each kind of violation, and only those."""
import sys
import unittest

sys.dont_write_bytecode = True  # the source folder stays as it is

from check_layers import (read_exceptions, read_table, table_violations,  # noqa: E402
                          violations_in)

TEXT = """room            may include, beside itself
include         -
src/kernels/core  include
src/kernels/late  include, src/kernels/core
src/io          include, src/kernels/core
src/mapper      include, src/kernels, cuda
src/ros         include
cuda            include, src/kernels
"""
TABLE = read_table(TEXT)
FILES = {"include/dtsdf_mapping/mesh.h", "src/kernels/core/vec.h", "src/kernels/late/cast.h",
         "src/io/text_file.h", "src/mapper/gpu.h", "src/ros/node.h", "cuda/cuda_backend.h"}


def rules(path, code, exceptions=frozenset()):
    return [rule for _, rule in violations_in(path, code, TABLE, FILES, exceptions)]


class Lines(unittest.TestCase):
    def test_what_is_allowed(self):
        for path, code in (
                ("src/io/a.cpp", '#include "io/text_file.h"\n#include "kernels/core/vec.h"\n'
                                 '#include <dtsdf_mapping/mesh.h>\n#include <vector>'),
                ("src/mapper/a.cpp", '#include "kernels/late/cast.h"'),
                ("src/kernels/core/a.h", "#include <cmath>"),
                ("cuda/a.cu", "#include <cuda_runtime.h>"), ("src/ros/a.cpp", "#include <ros/ros.h>"),
                ("src/io/a.cpp", '// never exit(1)\nthrow Error("abort()");\natexit(clean);')):
            self.assertEqual(rules(path, code), [], code)

    def test_what_is_not(self):
        for path, code in (
                ("src/io/a.cpp", '#include "kernels/late/cast.h"'),
                ("src/ros/a.cpp", '#include "../io/text_file.h"'),
                ("include/dtsdf_mapping/a.h", '#include "kernels/core/vec.h"'),
                ("src/kernels/core/a.h", "#include <vector>"),
                ("src/mapper/a.cpp", "#include <cuda_runtime.h>"),
                ("src/io/a.cpp", "#include <sensor_msgs/Image.h>"),
                ("src/io/a.cpp", "std::exit(1);"), ("cuda/a.cu", "cudaDeviceReset();"),
                ("src/io/a.cpp", "int " + 97 * "a")):
            self.assertEqual(len(rules(path, code)), 1, code)

    def test_exceptions_are_of_a_file_and_a_room(self):
        exceptions = read_exceptions(TEXT + "\nbeyond  room  why\nsrc/mapper/gpu.h  src/ros  a reason\n")
        code = '#include "mapper/gpu.h"'
        self.assertEqual(rules("src/ros/a.cpp", code, exceptions), [])
        self.assertEqual(len(rules("src/io/a.cpp", code, exceptions)), 1)


class Table(unittest.TestCase):
    def test_what_is_wrong_with_it(self):
        def count(text=TEXT, files=FILES, guide=None):
            return len(list(table_violations(text, read_table(text), files, guide or text)))
        self.assertEqual(count(), 0)
        self.assertEqual(count(guide=TEXT.replace("src/io", "src/oi")), 1)
        self.assertEqual(count(files=FILES | {"src/new/a.cpp"}), 1)
        self.assertEqual(count(files=FILES - {"src/io/text_file.h"}), 1)
        self.assertEqual(count(TEXT.replace("src/ros         include", "src/ros         src/mapper")
                               .replace("src/mapper      include", "src/mapper      src/ros")), 1)


if __name__ == "__main__":
    unittest.main()
