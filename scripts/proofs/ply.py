"""A reader for the binary .ply files that this package writes."""
import numpy as np

FORMATS = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
           "float": "<f4", "double": "<f8"}


def read_ply(path):
    """Returns the vertices, as an array with a field per property, and the triangles, as rows of indices."""
    with open(path, "rb") as file:
        head, _, data = file.read().partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii").splitlines()]
    counts = {words[1]: int(words[2]) for words in lines if words[0] == "element"}
    vertices = np.frombuffer(data, [(words[2], FORMATS[words[1]]) for words in lines
                                    if words[0] == "property" and words[1] != "list"], counts["vertex"])
    faces = np.frombuffer(data, [("count", "u1"), ("corners", "<u4", 3)], counts["face"], vertices.nbytes)
    return vertices, faces["corners"]


def columns(vertices, names):
    return np.stack([vertices[name] for name in names], axis=1)
