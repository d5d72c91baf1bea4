"""A reader for the binary .ply files that this package writes."""
import struct

FORMATS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
           "float": "f", "double": "d"}
FACE = struct.Struct("<B3I")


def read_ply(path):
    """(vertices, triangles): a dict by property name for each vertex, and index triples. Raises
    ValueError for what is not such a file, or not whole."""
    with open(path, "rb") as file:
        head, mark, data = file.read().partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    if not mark or lines[:2] != [["ply"], ["format", "binary_little_endian", "1.0"]]:
        raise ValueError(f"{path}: not a binary .ply file")
    counts = {words[1]: int(words[2]) for words in lines if words[0] == "element"}
    properties = [words for words in lines if words[0] == "property" and words[1] != "list"]
    row = struct.Struct("<" + "".join(FORMATS[words[1]] for words in properties))
    faces = row.size * counts["vertex"]
    if len(data) != faces + FACE.size * counts["face"]:
        raise ValueError(f"{path}: cut short, or not all triangles")
    names = [words[2] for words in properties]
    return ([dict(zip(names, values)) for values in row.iter_unpack(data[:faces])],
            [face[1:] for face in FACE.iter_unpack(data[faces:])])
