#!/usr/bin/env python3
"""Checks includes against the table in layers.txt; finds forbidden calls and long lines. Prints file:line
of each violation. A folder in the table is called a room.

Usage: check_layers.py ROOT
"""
import pathlib
import posixpath
import re
import sys

SOURCE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".cu", ".cuh"}
FOLDERS = ("include", "src", "cuda", "lab", "examples", "test")
INCLUDE_ROOTS = ("include", "src", "cuda", "lab", "test")  # as in the build
MAX_COLUMNS = 100
TABLE = pathlib.Path(__file__).resolve().with_name("layers.txt")
GUIDE = "CONTRIBUTING.md"

# Kernels may include only these headers, because kernels also run on a GPU.
KERNELS_MAY_INCLUDE = {"cmath", "cstring", "math.h", "cstdint", "stdint.h", "cfloat", "float.h",
                       "climits", "limits.h", "cstddef", "stddef.h"}
CUDA_HEADER = re.compile(
    r"(cuda\w*|cub|thrust|nvtx3?|curand\w*|device_launch_parameters|cooperative_groups\w*)"
    r"(/|\.h$|\.cuh$|\.hpp$)")
# Headers of ROS 1 packages, and those generated from this package's messages.
ROS_HEADER = re.compile(
    r"((ros|roscpp|rosbag|rosgraph_msgs|nodelet|pluginlib|class_loader|tf|tf2|tf2_\w+|tf2_ros"
    r"|std_msgs|std_srvs|sensor_msgs|geometry_msgs|visualization_msgs|diagnostic_msgs"
    r"|diagnostic_updater|image_transport|image_geometry|cv_bridge|message_filters|pcl_ros"
    r"|pcl_conversions|eigen_conversions|dynamic_reconfigure|xmlrpcpp|rosconsole)/"
    r"|XmlRpc\w*\.h$|dtsdf_mapping/[A-Z]\w*\.h$)")
KNOW_CUDA = ("cuda", "test/parity")
KNOW_ROS = ("src/ros", "src/rviz", "test/ros", "test/rviz")
# Calls that end the process, or reset the device that other nodelets use.
FATAL_CALL = re.compile(
    r"(?<![\w.>])(?:std\s*::\s*|::\s*)?"
    r"(exit|_exit|_Exit|quick_exit|abort|terminate|cudaDeviceReset)\s*\(")
INCLUDE = re.compile(r'\s*#\s*include\s*[<"]([^>"]+)[>"]')


def is_under(path, *folders):
    return any(path.startswith(folder + "/") for folder in folders)


def read_table(text):
    """{room: rooms it may include}, from the lines after the header of the table."""
    table = {}
    for line in text.partition("\n\n")[0].splitlines()[1:]:
        room, wanted = line.split(None, 1)
        table[room] = () if wanted == "-" else tuple(re.split(r",\s*", wanted))
    return table


def read_exceptions(text):
    """{(file or folder, room that may include it despite the table)}, from the lines after the table. Each
    line ends with the reason."""
    lines = (line.split(None, 2) for line in text.partition("\n\n")[2].splitlines()[1:])
    return {(file, room) for file, room, _ in lines}


def room_of(path, table):
    """The innermost room that contains a file, or None."""
    return max((room for room in table if is_under(path, room)), key=len, default=None)


def may_include(room, other, table):
    """Whether the list of a room names another room, or a folder that contains that room."""
    return any(other == wanted or wanted not in table and is_under(other, wanted)
               for wanted in table[room])


def find_circle(table):
    """A cycle of rooms that include each other, or None."""
    def below(room):
        return {r for r in table if may_include(room, r, table)} - {room}

    def search(room, trail):
        if room in trail:
            return trail[trail.index(room):] + [room]
        return next(filter(None, (search(r, trail + [room]) for r in sorted(below(room)))), None)
    return next(filter(None, (search(room, []) for room in table)), None)


def strip_comments_and_texts(code):
    """Replaces comments and string literals with spaces; keeps line breaks and #include lines."""
    def blank(match):
        text = match.group(0)
        return text if text.startswith("#") else re.sub(r"[^\n]", " ", text)
    return re.sub(r'#\s*include[^\n]*|//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', blank, code,
                  flags=re.S)


def resolve(path, header, files):
    """The package's own file that an include refers to, or None."""
    places = [posixpath.dirname(path)] + list(INCLUDE_ROOTS)
    names = (posixpath.normpath(posixpath.join(place, header)) for place in places)
    return next((name for name in names if name in files), None)


def exception_for(room, target, exceptions):
    """The exception that lets a room include the file `target`, or None."""
    return next((e for e in exceptions
                 if e[1] == room and (target == e[0] or is_under(target, e[0]))), None)


def own_include_violation(path, target, table, exceptions):
    """The rule that `path` breaks by including the package's own file `target`, or None."""
    room, target_room = room_of(path, table), room_of(target, table)
    if None in (room, target_room) or target_room == room or may_include(room, target_room, table):
        return None
    if exception_for(room, target, exceptions):
        return None
    return f"{room} may not include {target_room}"


def other_include_violation(path, header):
    """The rule that including another package's header breaks, or None."""
    if is_under(path, "src/kernels") and header not in KERNELS_MAY_INCLUDE:
        return "kernels may include only the C headers for maths, limits and memory"
    if CUDA_HEADER.match(header) and not is_under(path, *KNOW_CUDA):
        return "only cuda/ and test/parity may include CUDA headers"
    if ROS_HEADER.match(header) and not is_under(path, *KNOW_ROS):
        return "only src/ros, src/rviz and their tests may include ROS headers"
    return None


def line_violation(path, line):
    if is_under(path, "include", "src", "cuda") and not is_under(path, "src/tools"):
        match = FATAL_CALL.search(line)
        if match:
            return "library code must not call " + match.group(1) + "()"
    return None


def violations_in(path, code, table, files, exceptions=frozenset()):
    """(line number, rule) of each violation in a file. `path` and `files`, all files of the package, are
    relative to the root."""
    found = []
    for number, line in enumerate(strip_comments_and_texts(code).split("\n"), start=1):
        include = INCLUDE.match(line)
        if include is None:
            rule = line_violation(path, line)
        else:
            target = resolve(path, include.group(1), files)
            rule = (own_include_violation(path, target, table, exceptions) if target
                    else other_include_violation(path, include.group(1)))
        if rule:
            found.append((number, rule))
        if len(line) > MAX_COLUMNS:
            found.append((number, f"a line of more than {MAX_COLUMNS} columns"))
    return found


def table_violations(table_text, table, files, guide):
    """Finds errors in the table itself and in its copy in CONTRIBUTING.md."""
    circle = find_circle(table)
    if circle:
        yield "folders that include each other: " + " -> ".join(circle)
    for file in sorted(files):
        if room_of(file, table) is None:
            yield f"{file} is not in any folder of the table"
    for room in table:
        if not any(is_under(file, room) for file in files):
            yield f"folder {room} contains no files"
        for wanted in table[room]:
            if wanted not in table and not any(is_under(known, wanted) for known in table):
                yield f"{wanted}, which {room} may include, is not in the table"
    if table_text not in guide:
        yield f"{GUIDE} has a different table; copy this one there"


def unused_exceptions(root, files, table, exceptions):
    """Finds exceptions that no include needs."""
    used = set()
    for path in files:
        code = strip_comments_and_texts((root / path).read_text(encoding="utf-8"))
        for include in filter(None, map(INCLUDE.match, code.split("\n"))):
            target = resolve(path, include.group(1), files)
            used.add(target and exception_for(room_of(path, table), target, exceptions))
    return [f"no file of {room} includes {file}; remove the line"
            for file, room in sorted(exceptions - used)]


def main(root):
    files = {file.relative_to(root).as_posix() for folder in FOLDERS
             for file in (root / folder).rglob("*") if file.suffix in SOURCE_SUFFIXES}
    table_text = TABLE.read_text(encoding="utf-8")
    table = read_table(table_text)
    guide = (root / GUIDE).read_text(encoding="utf-8")
    exceptions = read_exceptions(table_text)
    lines = [f"{TABLE.name}: {rule}"
             for rule in [*table_violations(table_text, table, files, guide),
                          *unused_exceptions(root, files, table, exceptions)]]
    for path in sorted(files):
        code = (root / path).read_text(encoding="utf-8")
        lines += [f"{path}:{number}: {rule}"
                  for number, rule in violations_in(path, code, table, files, exceptions)]
    print("\n".join(lines + [f"{len(files)} files checked, {len(lines)} violations"]))
    return 1 if lines or not files else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
