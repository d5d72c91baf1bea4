#!/usr/bin/env python3
"""Shows that check_layers.py finds each kind of violation, and only those."""
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # the source folder stays as it is

from check_layers import (TABLE, read_exceptions, read_table, table_violations,  # noqa: E402
                          unused_exceptions, violations_in)

TEXT = """room            may include, beside itself
include         -
src/kernels/core  include
src/kernels/late  include, src/kernels/core
src/io          include, src/kernels/core
src/mapper      include, src/kernels, cuda
src/tools       include, src/io
src/ros         include
cuda            include, src/kernels, cuda/runtime
cuda/runtime    -
test            include, src, cuda
"""
TABLE_HERE = read_table(TEXT)
FILES = {"include/dtsdf_mapping/mesh.h", "src/kernels/core/vec.h", "src/kernels/late/cast.h",
         "src/io/text_file.h", "src/mapper/gpu.h", "src/tools/flight.h", "src/ros/node.h",
         "cuda/cuda_backend.h", "cuda/runtime/stream.h", "test/parity/test_frames.h"}


def rules(path, code):
    return violations_in(path, code, TABLE_HERE, FILES)


class Includes(unittest.TestCase):
    def assert_broken(self, path, code):
        self.assertEqual([number for number, _ in rules(path, code)], [1], code)

    def assert_kept(self, path, code):
        self.assertEqual(rules(path, code), [], code)

    def test_a_room_includes_itself_and_what_the_table_says(self):
        self.assert_kept("src/io/a.cpp", '#include "io/text_file.h"\n'
                                         '#include "kernels/core/vec.h"\n'
                                         '#include <dtsdf_mapping/mesh.h>\n#include <vector>')
        self.assert_broken("src/io/a.cpp", '#include "kernels/late/cast.h"')
        self.assert_broken("src/io/a.cpp", '#include "tools/flight.h"')
        self.assert_broken("include/dtsdf_mapping/a.h", '#include "kernels/core/vec.h"')
        self.assert_broken("src/kernels/core/a.h", '#include "kernels/late/cast.h"')

    def test_a_header_is_known_by_any_way_to_write_it(self):
        for header in ('"io/text_file.h"', "<io/text_file.h>", '"../io/text_file.h"'):
            self.assert_broken("src/ros/a.cpp", "#include " + header)
            self.assert_broken("src/ros/a.cpp", "  #  include " + header)
            self.assert_kept("src/ros/a.cpp", "// #include " + header)
        self.assert_broken("src/io/sub/a.cpp", '#include "cuda_backend.h"')

    def test_a_folder_of_rooms_stands_for_all_of_them(self):
        self.assert_kept("src/mapper/a.cpp", '#include "kernels/late/cast.h"')
        self.assert_kept("test/unit/a.cpp", '#include "ros/node.h"')

    def test_what_is_beyond_the_table_has_a_line_of_its_own(self):
        text = TEXT + ("\nbeyond  room  why\nsrc/mapper/gpu.h  src/ros  a reason\n"
                       "src/kernels/late  src/ros  another one\n")
        exceptions = read_exceptions(text)
        self.assertEqual(read_table(text), TABLE_HERE)
        code = '#include "mapper/gpu.h"\n#include "kernels/late/cast.h"'
        self.assertEqual(len(rules("src/ros/a.cpp", code)), 2)
        self.assertEqual(violations_in("src/ros/a.cpp", code, TABLE_HERE, FILES, exceptions), [])
        self.assertEqual(len(violations_in("src/io/a.cpp", code, TABLE_HERE, FILES, exceptions)), 2)
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for file in FILES | {"src/ros/a.cpp"}:
                (root / file).parent.mkdir(parents=True, exist_ok=True)
                (root / file).write_text(code if file == "src/ros/a.cpp" else "", encoding="utf-8")
            self.assertEqual(unused_exceptions(root, FILES, TABLE_HERE, exceptions),
                             [f"no file of src/ros includes {file}; take the line out"
                              for file in ("src/kernels/late", "src/mapper/gpu.h")])
            files = FILES | {"src/ros/a.cpp"}
            self.assertEqual(unused_exceptions(root, files, TABLE_HERE, exceptions), [])

    def test_a_reason_is_required(self):
        with self.assertRaises(ValueError):
            read_exceptions(TEXT + "\nbeyond  room  why\nsrc/mapper/gpu.h  src/ros\n")

    def test_a_room_does_not_stand_for_those_inside(self):
        self.assert_kept("src/mapper/a.cpp", '#include "cuda_backend.h"')
        self.assert_broken("src/mapper/a.cpp", '#include "runtime/stream.h"')
        self.assert_kept("cuda/a.cu", '#include "runtime/stream.h"')
        self.assert_broken("cuda/runtime/a.h", '#include "cuda_backend.h"')

    def test_kernels_include_only_themselves_and_c_maths(self):
        self.assert_kept("src/kernels/core/a.h", '#include <cmath>\n#include "kernels/core/vec.h"')
        self.assert_broken("src/kernels/core/a.h", "#include <vector>")
        self.assert_broken("src/kernels/late/a.h", "#include <Eigen/Core>")

    def test_no_cuda_header_outside_cuda(self):
        for header in ("cuda_runtime.h", "cub/cub.cuh", "thrust/sort.h", "cuda_fp16.h"):
            self.assert_broken("src/mapper/a.cpp", f"#include <{header}>")
            self.assert_broken("include/dtsdf_mapping/a.h", f"#include <{header}>")
            self.assert_broken("test/unit/a.cpp", f"#include <{header}>")
            self.assert_kept("cuda/a.cu", f"#include <{header}>")
            self.assert_kept("test/parity/a.cpp", f"#include <{header}>")

    def test_only_ros_knows_ros(self):
        for header in ("ros/ros.h", "tf2_ros/buffer.h", "sensor_msgs/Image.h", "XmlRpcValue.h",
                       "cv_bridge/cv_bridge.h", "dtsdf_mapping/MapStatus.h"):
            self.assert_broken("src/io/a.cpp", f"#include <{header}>")
            self.assert_broken("test/unit/a.cpp", f"#include <{header}>")
            self.assert_kept("src/ros/a.cpp", f"#include <{header}>")
            self.assert_kept("test/ros/a.cpp", f"#include <{header}>")


class Calls(unittest.TestCase):
    def test_no_call_ends_the_process(self):
        for call in ("exit(1);", "std::exit(1);", "  ::abort();", "cudaDeviceReset();",
                     "std::terminate();", "if (bad) _exit(2);"):
            for path in ("src/io/a.cpp", "include/dtsdf_mapping/a.h", "cuda/a.cu"):
                self.assertEqual(len(rules(path, call)), 1, call)
            self.assertEqual(rules("src/tools/a.cpp", call), [], call)
        for code in ("// never exit(1)", 'throw Error("abort()");', "atexit(clean); worker.exit();",
                     "/* exit(1);\nabort(); */"):
            self.assertEqual(rules("src/io/a.cpp", code), [], code)

    def test_the_line_is_told(self):
        self.assertEqual([n for n, _ in rules("src/io/a.cpp", "/* \n */ int a;\nabort();")], [3])


class Columns(unittest.TestCase):
    def test_lines_end_by_column_100(self):
        for long in ("int " + 97 * "a", "// " + 98 * "a", 'f("' + 98 * "a"):
            self.assertEqual(len(rules("src/io/a.cpp", long)), 1, long)
            self.assertEqual(rules("src/io/a.cpp", long[:100]), [], long)
        self.assertEqual(rules("src/io/a.cpp", "// " + 97 * "\u00e4"), [])


class Table(unittest.TestCase):
    def violations(self, text=TEXT, files=FILES, guide=None):
        return list(table_violations(text, read_table(text), files,
                                     "Rooms:\n" + text if guide is None else guide))

    def test_a_sound_table(self):
        self.assertEqual(self.violations(), [])

    def test_the_guide_shows_the_same_table(self):
        self.assertEqual(len(self.violations(guide="Rooms:\n" + TEXT.replace("src/io", "src/oi"))),
                         1)

    def test_each_file_lies_in_a_room(self):
        self.assertEqual(len(self.violations(files=FILES | {"src/new/a.cpp"})), 1)

    def test_each_room_has_a_file(self):
        self.assertEqual(len(self.violations(files=FILES - {"src/tools/flight.h"})), 1)

    def test_each_list_names_rooms(self):
        self.assertEqual(len(self.violations(TEXT.replace("include, src/io", "include, src/oi"))),
                         1)

    def test_rooms_form_no_circle(self):
        circle = self.violations(TEXT.replace("src/ros         include",
                                              "src/ros         src/tools")
                                 .replace("src/io          include", "src/io          src/ros"))
        self.assertEqual(len(circle), 1)
        for room in ("src/ros", "src/tools", "src/io"):
            self.assertIn(room, circle[0])

    def test_the_package_s_own_table_can_be_read(self):
        table = read_table(TABLE.read_text(encoding="utf-8"))
        self.assertEqual(table["include"], ())
        self.assertIn("src/mapper", table)


if __name__ == "__main__":
    sys.exit(unittest.main())
