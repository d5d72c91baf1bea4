"""A reader for the binary .ply files that this package writes."""
import struct

FORMATS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
           "float": "f", "double": "d"}


def read_ply(path):
    """(vertices, triangles): a dict by property name for each vertex, and index triples."""
    with open(path, "rb") as file:
        data = file.read()
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
    names = [name for name, _ in properties]
    vertices = [dict(zip(names, row.unpack_from(data, end + i * row.size)))
                for i in range(counts["vertex"])]
    face = struct.Struct("<B3i")
    start = end + row.size * counts["vertex"]
    triangles = [face.unpack_from(data, start + i * face.size)[1:] for i in range(counts["face"])]
    return vertices, triangles
