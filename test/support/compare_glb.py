#!/usr/bin/env python3
"""Reads a .glb by the specification of glTF 2.0, and a .ply, and compares what they show.

compare_glb.py MESH.glb MESH.ply: exits 0 if the .glb keeps to the specification as far as it is
used here, and both have the same vertices, normals, colours and triangles, the .glb's with y up.
"""
import array
import json
import math
import struct
import sys

COMPONENTS = {5121: ("B", 1), 5123: ("H", 2), 5125: ("I", 4), 5126: ("f", 4)}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def require(condition, text):
    if not condition:
        sys.exit(f"compare_glb.py: {text}")


def read_chunks(data):
    """The JSON and the binary chunk."""
    magic, version, length = struct.unpack_from("<III", data, 0)
    require(magic == 0x46546C67 and version == 2, "no glTF 2.0")
    require(length == len(data), f"says {length} bytes, has {len(data)}")
    at, chunks = 12, []
    while at < length:
        size, kind = struct.unpack_from("<II", data, at)
        require(size % 4 == 0, "a chunk is not aligned")
        chunks.append((kind, data[at + 8:at + 8 + size]))
        at += 8 + size
    require([kind for kind, _ in chunks] == [0x4E4F534A, 0x004E4942], "wrong chunks")
    return json.loads(chunks[0][1].decode("utf-8")), chunks[1][1]


def check_document(document, binary):
    """What is there, and nothing else; the views lie one behind the other."""
    require(document["asset"]["version"] == "2.0", "wrong version")
    require(set(document) == {"asset", "scene", "scenes", "nodes", "meshes", "materials",
                              "accessors", "bufferViews", "buffers"}, "other properties")
    require([len(document[part]) for part in ("scenes", "nodes", "meshes", "materials", "accessors",
                                              "bufferViews", "buffers")] == [1, 2, 1, 1, 4, 4, 1],
            "a part is not used, or missing")
    end = 0
    for view in document["bufferViews"]:
        require(view["byteOffset"] == end and end % 4 == 0, "views overlap or leave bytes out")
        end += view["byteLength"]
    require(document["buffers"][0]["byteLength"] == end == len(binary), "wrong buffer size")
    material, = document["materials"]  # a viewer multiplies colours with it; metal would be black
    require(material == {"name": "surface", "doubleSided": True, "pbrMetallicRoughness":
                         {"metallicFactor": 0.0, "roughnessFactor": 1.0}}, "another material")


def read_accessor(document, binary, number, kind):
    """Its elements as tuples; normalised whole numbers as shares of 1."""
    accessor = document["accessors"][number]
    require(accessor["type"] == kind, f"accessor {number} is {accessor['type']}")
    view = document["bufferViews"][accessor["bufferView"]]
    require(view["target"] == (34963 if kind == "SCALAR" else 34962), "wrong target of a view")
    code, bytes_each = COMPONENTS[accessor["componentType"]]
    width = SIZES[kind]
    begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    require(begin % bytes_each == 0 and width * bytes_each % (4 if kind != "SCALAR" else 1) == 0,
            f"accessor {number} is not aligned")
    size = accessor["count"] * width * bytes_each
    require(size == view["byteLength"], f"accessor {number} is not its view")
    values = array.array(code, binary[begin:begin + size])
    if sys.byteorder == "big":
        values.byteswap()
    if accessor.get("normalized"):
        values = [value / (256 ** bytes_each - 1) for value in values]
    return list(zip(*[iter(values)] * width))


def rotated(q, v):
    """v turned by the quaternion q = (x, y, z, w)."""
    x, y, z, w = q
    cross = (y * v[2] - z * v[1] + w * v[0], z * v[0] - x * v[2] + w * v[1],
             x * v[1] - y * v[0] + w * v[2])
    return tuple(v[i] + 2.0 * d for i, d in enumerate(
        (y * cross[2] - z * cross[1], z * cross[0] - x * cross[2], x * cross[1] - y * cross[0])))


def read_glb(path):
    with open(path, "rb") as file:
        document, binary = read_chunks(file.read())
    check_document(document, binary)
    scene = document["scenes"][document["scene"]]
    require(len(scene["nodes"]) == 1, "one root is expected")
    root = document["nodes"][scene["nodes"][0]]
    node = document["nodes"][root["children"][0]]
    primitive, = document["meshes"][node["mesh"]]["primitives"]
    require(primitive.get("mode", 4) == 4, "no triangles")
    require(primitive["material"] == 0, "no material")
    attributes = primitive["attributes"]
    positions = read_accessor(document, binary, attributes["POSITION"], "VEC3")
    bounds = document["accessors"][attributes["POSITION"]]
    for axis in range(3):
        values = [p[axis] for p in positions]
        require(min(values) == bounds["min"][axis] and max(values) == bounds["max"][axis],
                "wrong bounds")
    origin = node["translation"]
    place = [rotated(root["rotation"], tuple(a + b for a, b in zip(p, origin))) for p in positions]
    normals = [rotated(root["rotation"], n)
               for n in read_accessor(document, binary, attributes["NORMAL"], "VEC3")]
    colours = read_accessor(document, binary, attributes["COLOR_0"], "VEC3")
    indices = [i for i, in read_accessor(document, binary, primitive["indices"], "SCALAR")]
    require(len(indices) % 3 == 0, "a triangle lacks a corner")
    require(set(indices) == set(range(len(positions))), "a vertex is in no triangle, or missing")
    return place, normals, colours, list(zip(*[iter(indices)] * 3)), max(
        max(map(abs, p)) for p in positions)


def read_ply(path):
    with open(path, "rb") as file:
        header = b""
        while not header.endswith(b"end_header\n"):
            header += file.readline()
        body = file.read()
    counts = [int(line.split()[2]) for line in header.decode().splitlines()
              if line.startswith("element")]
    scalar = "d" if b"property double x" in header else "f"
    row = struct.Struct(f"<3{scalar}3f3B")
    vertices = [row.unpack_from(body, i * row.size) for i in range(counts[0])]
    faces = struct.Struct("<B3i")
    at = counts[0] * row.size
    triangles = [faces.unpack_from(body, at + i * faces.size)[1:] for i in range(counts[1])]
    return vertices, triangles


def srgb(light):
    value = 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055
    return round(255.0 * value)


def main():
    places, normals, colours, triangles, reach = read_glb(sys.argv[1])
    vertices, faces = read_ply(sys.argv[2])
    require(len(places) == len(vertices), f"{len(places)} vertices, not {len(vertices)}")
    require(triangles == faces, "other triangles")
    extent = max(max(v[i] for v in vertices) - min(v[i] for v in vertices) for i in range(3))
    require(reach <= extent + 1.0, "positions do not count from the middle of the mesh")
    for place, normal, colour, vertex in zip(places, normals, colours, vertices):
        # y is up in glTF, z in the map; x stays.
        x, y, z, nx, ny, nz, *rgb = vertex
        error = max(abs(a - b) for a, b in zip(place, (x, z, -y)))
        require(error <= 1e-6 * (1.0 + reach), f"a vertex is {error} m off")
        length = math.hypot(nx, ny, nz)  # glTF has normals of length 1 only
        upright = (nx / length, nz / length, -ny / length) if length > 0 else (0, 1, 0)
        require(math.dist(normal, upright) < 1e-6, "another normal")
        require([srgb(c) for c in colour] == rgb, "another colour")
    print(f"{len(vertices)} vertices, {len(faces)} triangles alike")


if __name__ == "__main__":
    main()
