"""A reader for the binary .ply files that this package writes."""
import struct

FORMATS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
           "float": "f", "double": "d"}
FACE = struct.Struct("<B3I")


def read_rows(path):
    """(names of the properties of vertices, an iterator over their rows, one over faces, each the
    number of corners and three indices). Raises ValueError for what is no such file, or not whole."""
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(b"ply\n") or b"end_header\n" not in data:
        raise ValueError(f"{path}: not a .ply file")
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts, properties = {}, []
    for line in data[:end].decode("ascii").splitlines():
        words = line.split()
        if words[0] == "format" and words[1] != "binary_little_endian":
            raise ValueError(f"{path}: not in binary_little_endian")
        if words[0] == "element":
            counts[words[1]] = int(words[2])
        if words[0] == "property" and words[1] != "list":
            properties.append((words[2], FORMATS[words[1]]))
    row = struct.Struct("<" + "".join(kind for _, kind in properties))
    faces = end + row.size * counts["vertex"]
    if len(data) != faces + FACE.size * counts["face"]:
        raise ValueError(f"{path}: cut short, or not all triangles")
    return ([name for name, _ in properties], row.iter_unpack(data[end:faces]),
            FACE.iter_unpack(data[faces:]))


def read_ply(path):
    """(vertices, triangles): a dict by property name for each vertex, and index triples."""
    names, vertices, faces = read_rows(path)
    return [dict(zip(names, row)) for row in vertices], [face[1:] for face in faces]
