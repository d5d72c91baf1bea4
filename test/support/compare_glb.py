#!/usr/bin/env python3
"""Checks that a .glb file conforms to the parts of the glTF 2.0 specification that it uses, and that it contains
the same vertices, normals, colours and triangles as a .ply file (with y up in the .glb file). Exits with 1 and an
error text if not.

Usage: compare_glb.py MESH.glb MESH.ply
"""
import json
import struct
import sys

import numpy as np

WIDTHS = {"SCALAR": 1, "VEC3": 3}
MATERIAL = {"name": "surface", "doubleSided": True,
            "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}


def require(condition, text):
    if not condition:
        sys.exit(f"compare_glb.py: {text}")


def read_chunks(data):
    """Returns the JSON chunk and the binary chunk."""
    magic, version, length, json_bytes, json_kind = struct.unpack_from("<5I", data)
    require((magic, version, length) == (0x46546C67, 2, len(data)), "not glTF 2.0, or wrong length")
    binary_bytes, binary_kind = struct.unpack_from("<2I", data, 20 + json_bytes)
    require((json_kind, binary_kind) == (0x4E4F534A, 0x004E4942), "not a JSON and a binary chunk")
    require(json_bytes % 4 == 0 and 28 + json_bytes + binary_bytes == length, "chunks are not aligned")
    return json.loads(data[20:20 + json_bytes]), data[28 + json_bytes:]


def check_views(document, binary):
    """Checks that the buffer views are contiguous."""
    end = 0
    for view in document["bufferViews"]:
        require(view["byteOffset"] == end and end % 4 == 0, "buffer views overlap or have gaps")
        end += view["byteLength"]
    require(document["buffers"][0]["byteLength"] == end == len(binary), "the buffer has the wrong size")


def read_accessor(document, binary, number, kind):
    """Returns the elements of an accessor as rows."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    index = kind == "SCALAR"
    require((accessor["type"], accessor["componentType"], view["target"]) ==
            (kind, *((5125, 34963) if index else (5126, 34962))), f"accessor {number}: wrong type")
    values = np.frombuffer(binary, "<u4" if index else "<f4", view["byteLength"] // 4, view["byteOffset"])
    require(len(values) == WIDTHS[kind] * accessor["count"], f"accessor {number}: its view has the wrong size")
    return values.reshape(-1, WIDTHS[kind])


def rotated(q, v):
    """Rotates rows by the quaternion q = (x, y, z, w)."""
    return v + 2.0 * np.cross(q[:3], np.cross(q[:3], v) + q[3] * v)


def read_glb(path):
    with open(path, "rb") as file:
        document, binary = read_chunks(file.read())
    check_views(document, binary)
    require(document["asset"]["version"] == "2.0", "the version should be 2.0")
    # Viewers multiply vertex colours by the material's colour, and draw metal black.
    require(document["materials"] == [MATERIAL], "the material should be matte and double-sided")
    root = document["nodes"][document["scenes"][document["scene"]]["nodes"][0]]
    node = document["nodes"][root["children"][0]]
    primitive, = document["meshes"][node["mesh"]]["primitives"]
    require(primitive.get("mode", 4) == 4 and primitive["material"] == 0, "not triangles with material 0")
    attributes = primitive["attributes"]
    positions, normals, colours = (read_accessor(document, binary, attributes[name], "VEC3")
                                   for name in ("POSITION", "NORMAL", "COLOR_0"))
    bounds = document["accessors"][attributes["POSITION"]]
    require((positions.min(axis=0) == bounds["min"]).all() and
            (positions.max(axis=0) == bounds["max"]).all(), "the bounds do not match the positions")
    turn = np.array(root["rotation"])
    triangles = read_accessor(document, binary, primitive["indices"], "SCALAR").reshape(-1, 3)
    require(np.array_equal(np.unique(triangles), np.arange(len(positions))), "the triangles should use all vertices")
    return (rotated(turn, positions + np.array(node["translation"])), rotated(turn, normals), colours,
            triangles, abs(positions).max())


def read_ply(path):
    with open(path, "rb") as file:
        header, _, body = file.read().partition(b"end_header\n")
    vertices, faces = (int(line.split()[2]) for line in header.splitlines() if line.startswith(b"element"))
    scalar = "<f8" if b"property double x" in header else "<f4"
    row = np.dtype([("p", scalar, 3), ("n", "<f4", 3), ("rgb", "u1", 3)])
    return np.frombuffer(body, row, vertices), np.frombuffer(
        body, [("count", "u1"), ("face", "<u4", 3)], faces, vertices * row.itemsize)["face"]


def main():
    places, normals, colours, triangles, reach = read_glb(sys.argv[1])
    vertices, faces = read_ply(sys.argv[2])
    require(len(places) == len(vertices) and np.array_equal(triangles, faces), "numbers of vertices or triangles differ")
    require(reach <= np.ptp(vertices["p"], axis=0).max() + 1.0, "positions are far from the origin")

    def upright(rows):
        """Converts from z up (map) to y up (glTF)."""
        return rows[:, [0, 2, 1]] * [1, 1, -1]

    require(abs(places - upright(vertices["p"])).max() <= 1e-6 * (1.0 + reach), "a vertex differs")
    length = np.linalg.norm(vertices["n"], axis=1, keepdims=True)  # glTF requires unit normals
    unit = np.where(length > 0, upright(vertices["n"]) / np.maximum(length, 1e-9), [0, 1, 0])
    require(np.linalg.norm(normals - unit, axis=1).max() < 1e-6, "a normal differs")
    srgb = np.where(colours <= 0.0031308, 12.92 * colours, 1.055 * colours ** (1 / 2.4) - 0.055)
    require((np.round(255.0 * srgb) == vertices["rgb"]).all(), "a colour differs")


if __name__ == "__main__":
    main()
