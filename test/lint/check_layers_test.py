#!/usr/bin/env python3
"""Shows that check_layers.py finds each kind of violation, and only those."""
import sys
import unittest

sys.dont_write_bytecode = True  # the source folder stays as it is

from check_layers import violations_in  # noqa: E402

KERNEL = "include/dtsdf_mapping/kernels/a.h"


class CheckLayers(unittest.TestCase):
    def assert_broken(self, path, code):
        self.assertEqual([number for number, _ in violations_in(path, code)], [1], code)

    def assert_kept(self, path, code):
        self.assertEqual(violations_in(path, code), [], code)

    def test_kernels_include_only_themselves_and_c_maths(self):
        self.assert_kept(KERNEL, '#include <cmath>\n#include "dtsdf_mapping/kernels/vec.h"')
        self.assert_broken(KERNEL, "#include <vector>")
        self.assert_broken(KERNEL, '#include "dtsdf_mapping/map/map_params.h"')

    def test_no_cuda_header_outside_cuda(self):
        for header in ("cuda_runtime.h", "cub/cub.cuh", "thrust/sort.h", "cuda_fp16.h"):
            self.assert_broken("include/dtsdf_mapping/map/a.h", f"#include <{header}>")
            self.assert_kept("cuda/a.cu", f"#include <{header}>")

    def test_only_factory_and_tests_know_the_backend(self):
        for header in ("cuda/cuda_mapper.h", "cuda_mapper.h", "../../cuda/cuda_mapper.h"):
            code = f'#include "{header}"'
            self.assert_broken("src/ros/node.cpp", code)
            self.assert_kept("src/mapper/mapper_factory.cpp", code)
            self.assert_kept("test/parity/a.cpp", code)
        self.assert_broken("src/mapper/mapper_factory.cpp", "#include <cuda_runtime.h>")

    def test_only_ros_knows_ros(self):
        for header in ("ros/ros.h", "tf2_ros/buffer.h", "sensor_msgs/Image.h",
                       "dtsdf_mapping/MapStatus.h", "dtsdf_mapping/ros/node.h"):
            self.assert_broken("src/io/a.cpp", f"#include <{header}>")
            self.assert_kept("src/ros/a.cpp", f"#include <{header}>")
        self.assert_kept("src/io/a.cpp", '#include "dtsdf_mapping/io/trajectory.h"')

    def test_programs_know_the_settings_of_the_node_which_know_no_ros(self):
        code = '#include "dtsdf_mapping/ros/node_params.h"'
        self.assert_kept("src/tools/a.cpp", code)
        self.assert_broken("src/map/a.cpp", code)
        self.assert_broken("include/dtsdf_mapping/ros/node_params.h", "#include <ros/ros.h>")

    def test_core_does_not_know_io(self):
        self.assert_broken("src/map/a.cpp", '#include "dtsdf_mapping/io/mesh_file.h"')
        self.assert_kept("src/tools/a.cpp", '#include "dtsdf_mapping/io/mesh_file.h"')

    def test_no_call_ends_the_process(self):
        for call in ("exit(1);", "std::exit(1);", "  ::abort();", "cudaDeviceReset();",
                     "std::terminate();", "if (bad) _exit(2);"):
            self.assert_broken("src/map/a.cpp", call)
        self.assert_kept("src/map/a.cpp", "// never exit(1)")
        self.assert_kept("src/map/a.cpp", 'throw Error("abort()");')
        self.assert_kept("src/map/a.cpp", "atexit(clean); worker.exit();")


if __name__ == "__main__":
    sys.exit(unittest.main())
