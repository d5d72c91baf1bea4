"""Writes TUM folders and PNG images using only the standard library."""
import os
import struct
import zlib


def png(rows, bits=16, channels=1):
    """Returns a greyscale (1 channel) or colour (3 channels) PNG as bytes. Each row is given as big-endian bytes."""
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    width = 8 * len(rows[0]) // (bits * channels)
    header = struct.pack(">IIBBBBB", width, len(rows), bits, 0 if channels == 1 else 2, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows), 1)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) +
            chunk(b"IEND", b""))


def write(folder, images):
    """Writes depth images and their poses. Each image is (stamp, PNG, (tx, ty, tz, qx, qy, qz, qw))."""
    os.makedirs(os.path.join(folder, "depth"))
    with open(os.path.join(folder, "depth.txt"), "w", encoding="ascii") as depth, \
            open(os.path.join(folder, "groundtruth.txt"), "w", encoding="ascii") as poses:
        depth.write("# stamp file\n")
        for stamp, image, pose in images:
            with open(os.path.join(folder, "depth", f"{stamp}.png"), "wb") as file:
                file.write(image)
            depth.write(f"{stamp} depth/{stamp}.png\n")
            poses.write(f"{stamp} {' '.join(f'{x:.9f}' for x in pose)}\n")
