#!/usr/bin/env python3
"""Reads a map file with numpy: read_map.py FILE.dtsdf. docs/map_format.md describes the format.

Needs python3-numpy and python3-zstandard. Checksums are not verified: use map_tool info --verify.
"""
import struct
import sys

import numpy
import zstandard


def records(path):
    """Concatenated contents of all records of each kind, as {kind: bytes}."""
    with open(path, "rb") as file:
        magic, version, purpose = struct.unpack("<8sI4s", file.read(16))
        if magic != b"DTSDFREC" or purpose != b"MAP " or version != 1:
            raise ValueError(f"{path} is not a map file that this program can read")
        contents = {}
        while head := file.read(24):
            kind, flags, stored, _ = struct.unpack("<4sIQQ", head)
            content = file.read(stored)
            if flags & 1:
                content = zstandard.ZstdDecompressor().decompress(content)
            contents.setdefault(kind.decode(), []).append(content)
    return {kind: b"".join(parts) for kind, parts in contents.items()}


def free_cells(content):
    """Coordinates of the free cells, in units of cells. `content` begins with the cell size in voxels."""
    cubes = numpy.frombuffer(content[8:], [("key", "<i4", 3), ("zero", "<u4"), ("cells", "u1", 64)])
    bits = numpy.unpackbits(cubes["cells"], axis=1, bitorder="little").reshape(-1, 8, 8, 8)
    cube, z, y, x = numpy.nonzero(bits)
    return 8 * cubes["key"][cube] + numpy.stack([x, y, z], axis=1)


def read_map(path):
    """Returns the settings as strings, and blocks, voxels, free cells and colours as numpy arrays."""
    content = records(path)
    settings = dict(line.split(": ", 1) for line in content["SETT"].decode().splitlines())
    blocks = numpy.frombuffer(content["BLKS"], [("key", "<i4", 3), ("directions", "<u4")])
    directions = [(i, d) for i, bits in enumerate(blocks["directions"]) for d in range(6)
                  if bits >> d & 1]
    words = numpy.frombuffer(content["VOXL"], "<u8").reshape(-1, 8, 8, 8)  # array, z, y, x
    return {"settings": settings, "keys": blocks["key"], "array_of": numpy.array(directions),
            "distance_voxels": (words & 0xffff).astype(numpy.uint16).view(numpy.int16) / 2048.0,
            "evidence": (words >> 32 & 0xff).astype(numpy.uint8).view(numpy.int8),
            "weight": (words >> 40) / 65536.0,
            "free_cells": free_cells(content.get("FREE", bytes(8))),
            "colours": numpy.frombuffer(content.get("COLR", b""), "u1").reshape(-1, 4, 4, 4, 4)}


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__ if "--help" not in sys.argv else print(__doc__))
    the_map = read_map(sys.argv[1])
    known = the_map["evidence"] > 0
    print("voxel size", the_map["settings"]["map/voxel_size_m"])
    print("blocks", len(the_map["keys"]))
    print("voxel arrays", len(the_map["array_of"]))
    print("known voxels", numpy.count_nonzero(known))
    print("sum of distances %.6f" % the_map["distance_voxels"][known].sum())
    print("sum of weights %.6f" % the_map["weight"][known].sum())
    print("free cells", len(the_map["free_cells"]))
    print("painted voxels", numpy.count_nonzero(the_map["colours"][..., 3]))
    print("sum of colours", int(the_map["colours"][..., :3].sum(dtype=numpy.int64)))
