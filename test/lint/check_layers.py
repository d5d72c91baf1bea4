#!/usr/bin/env python3
"""Checks the rules between the package's layers; prints file:line of each violation.

Usage: check_layers.py ROOT
"""
import pathlib
import re
import sys

SOURCE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".cu", ".cuh"}
FOLDERS = ("include", "src", "cuda", "test")

OWN = "dtsdf_mapping/"
KERNELS_MAY_INCLUDE = {"cmath", "cstring", "math.h", "cstdint", "stdint.h", "cfloat", "float.h",
                       "climits", "limits.h", "cstddef", "stddef.h"}
CUDA_HEADER = re.compile(
    r"(cuda\w*|cub|thrust|nvtx3?|curand\w*|device_launch_parameters|cooperative_groups\w*)"
    r"(/|\.h$|\.cuh$|\.hpp$)")
# Folders of ROS 1 packages, and what is generated from this package's messages.
ROS_HEADER = re.compile(
    r"((ros|roscpp|rosbag|rosgraph_msgs|nodelet|pluginlib|class_loader|tf|tf2|tf2_\w+|tf2_ros"
    r"|std_msgs|std_srvs|sensor_msgs|geometry_msgs|visualization_msgs|diagnostic_msgs"
    r"|diagnostic_updater|image_transport|image_geometry|cv_bridge|message_filters|pcl_ros"
    r"|pcl_conversions|eigen_conversions|dynamic_reconfigure|xmlrpcpp|rosconsole)/"
    r"|XmlRpc\w*\.h$|dtsdf_mapping/[A-Z]\w*\.h$|dtsdf_mapping/ros/)")
# Calls that end the process or reset the device under every other nodelet's feet.
FATAL_CALL = re.compile(
    r"(?<![\w.>])(?:std\s*::\s*|::\s*)?"
    r"(exit|_exit|_Exit|quick_exit|abort|terminate|cudaDeviceReset)\s*\(")
# Plain data without a ROS header: programs accept the node's settings files.
ROS_FREE = OWN + "ros/node_params.h"
INCLUDE = re.compile(r'\s*#\s*include\s*[<"]([^>"]+)[>"]')


def strip_comments_and_texts(code):
    """Blanks comments and string texts, keeps the line breaks and #include lines."""
    def blank(match):
        text = match.group(0)
        return text if text.startswith("#") else re.sub(r"[^\n]", " ", text)
    return re.sub(r'#\s*include[^\n]*|//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', blank, code,
                  flags=re.S)


def is_under(path, *folders):
    return any(path.startswith(folder + "/") for folder in folders)


def include_violation(path, header):
    """The rule that `path` breaks by including `header`, or None."""
    is_kernel = is_under(path, "include/dtsdf_mapping/kernels", "src/kernels")
    if is_kernel and not (header.startswith(OWN + "kernels/") or header in KERNELS_MAY_INCLUDE):
        return "kernels/ may include only kernels/ and the C headers of maths and memory"
    if is_under(path, "include", "src"):
        is_backend = re.search(r"(^|/)cuda/|^cuda_(mapper|backend)\w*\.h$", header)
        if is_backend and not path.startswith("src/mapper/mapper_factory"):
            return "only the factory and the tests know cuda/"
        if CUDA_HEADER.match(header) and not is_backend:
            return "no CUDA header outside cuda/"
    knows_ros = is_under(path, "include/dtsdf_mapping/ros", "src/ros", "test/ros")
    if path == "include/" + ROS_FREE:
        knows_ros = False
    if header == ROS_FREE and is_under(path, "src/tools", "test"):
        return None
    if not knows_ros and ROS_HEADER.match(header):
        return "only ros/ knows ROS"
    inner = is_under(path, *[part + layer for layer in ("map", "fusion", "meshing", "params", "cpu")
                             for part in ("include/dtsdf_mapping/", "src/")])
    if inner and re.match(OWN + r"(io|ros|simulation)/", header):
        return "the core does not know io/, simulation/ and ros/"
    return None


def line_violation(path, line):
    if is_under(path, "include", "src", "cuda") and not is_under(path, "src/tools"):
        match = FATAL_CALL.search(line)
        if match:
            return "library code never calls " + match.group(1) + "()"
    return None


def violations_in(path, code):
    """(line number, rule) of each violation in a file; `path` is relative to the root."""
    found = []
    for number, line in enumerate(strip_comments_and_texts(code).split("\n"), start=1):
        include = INCLUDE.match(line)
        rule = include_violation(path, include.group(1)) if include else line_violation(path, line)
        if rule:
            found.append((number, rule))
    return found


def main(root):
    count = files = 0
    for folder in FOLDERS:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in SOURCE_SUFFIXES:
                continue
            files += 1
            path = file.relative_to(root).as_posix()
            for number, rule in violations_in(path, file.read_text(encoding="utf-8")):
                print(f"{path}:{number}: {rule}")
                count += 1
    print(f"{files} files checked, {count} violations")
    return 1 if count or not files else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
