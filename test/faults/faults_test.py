#!/usr/bin/env python3
"""Has each of the first calls of `reconstruct` fail, one per run, and then a sample of the others:
whatever fails, it ends with one sentence or goes on, and the mesh of before is whole.

Counted from when the recording is opened: the library that reads the command line, CLI11, ends the
program itself where it has no memory."""

import argparse
import os
import random
import struct
import subprocess
import sys
import tempfile
import zlib

CALLS = ["open", "write", "fsync", "rename", "allocate"]
WIDTH, HEIGHT, FRAMES = 64, 48, 3
OLD_MESH = b"the mesh of before\n"


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def depth_png(depth_mm):
    """An image whose pixels are depth_mm(u, v)."""
    rows = b"".join(
        b"\0" + b"".join(struct.pack(">H", depth_mm(u, v)) for u in range(WIDTH))
        for v in range(HEIGHT))
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 16, 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
            chunk(b"IEND", b""))


def write_recording(folder):
    """A wall with a step, seen by a camera that stands still."""
    os.makedirs(os.path.join(folder, "depth"))
    with open(os.path.join(folder, "depth.txt"), "w") as images, \
            open(os.path.join(folder, "groundtruth.txt"), "w") as poses:
        for i in range(FRAMES):
            with open(os.path.join(folder, "depth", "%d.png" % i), "wb") as image:
                image.write(depth_png(lambda u, v: 5000 if u < 30 else 4000))
            images.write("%d.0 depth/%d.png\n" % (i + 1, i))
            poses.write("%d.0 0 0 0 0 0 0 1\n" % (i + 1))


class Reconstruction:
    """Runs `reconstruct` with a fault."""

    def __init__(self, program, library, folder):
        self.folder = folder
        self.library = library
        recording = os.path.join(folder, "recording")
        write_recording(recording)
        self.mesh = os.path.join(folder, "out", "mesh.ply")
        os.makedirs(os.path.dirname(self.mesh))
        self.met = os.path.join(folder, "met")
        self.command = [program, recording, "--mesh", self.mesh, "--intrinsics", "60,60,31.5,23.5",
                        "--set", "map/voxel_size_m=0.05", "--set", "threads=2",
                        "--set", "backend=cpu"]
        self.new_mesh = self.make_new_mesh()

    def make_new_mesh(self):
        done = subprocess.run(self.command, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit("reconstruct fails without any fault: " + done.stderr)
        return self.read_mesh()

    def read_mesh(self):
        with open(self.mesh, "rb") as mesh:
            return mesh.read()

    def run(self, call, number):
        """What is wrong after this fault ("" if nothing is), and whether it was met."""
        for left in os.listdir(os.path.dirname(self.mesh)):
            os.remove(os.path.join(os.path.dirname(self.mesh), left))
        with open(self.mesh, "wb") as mesh:
            mesh.write(OLD_MESH)
        if os.path.exists(self.met):
            os.remove(self.met)
        environment = dict(os.environ, LD_PRELOAD=self.library, DTSDF_FAULT_MET=self.met,
                           DTSDF_FAULT="%s:%d" % (call, number), DTSDF_FAULT_FROM="depth.txt")
        try:
            done = subprocess.run(self.command, capture_output=True, text=True, env=environment,
                                  timeout=120)
        except subprocess.TimeoutExpired:
            return "it hangs", True
        return self.problem(done), os.path.exists(self.met)

    def problem(self, done):
        if done.returncode < 0:
            said = " ".join(done.stderr.split())[-300:]
            return "it ends by signal %d: %s" % (-done.returncode, said)
        if done.returncode > 0 and not done.stderr.strip():
            return "it ends with %d and says nothing" % done.returncode
        mesh = self.read_mesh()
        if mesh not in (OLD_MESH, self.new_mesh):
            return "the mesh is neither that of before nor the whole new one"
        if done.returncode == 0 and mesh != self.new_mesh:
            return "it says that all is well, but the mesh is that of before"
        left = sorted(os.listdir(os.path.dirname(self.mesh)))
        if left != ["mesh.ply"]:
            return "beside the mesh it leaves %s" % left
        return ""


def numbers(first, sampled, most):
    """The first calls one by one, then a sample of those up to `most`."""
    yield from range(1, first + 1)
    if most > first:
        rest = range(first + 1, most + 1)
        yield from sorted(random.Random(1).sample(rest, min(sampled, len(rest))))


def count_calls(reconstruction, call):
    """How many there are: the fault that is not met any more, by halving."""
    low, high = 0, 1
    while reconstruction.run(call, high)[1]:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if reconstruction.run(call, middle)[1] else (low, middle)
    return low


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reconstruct", required=True)
    parser.add_argument("--library", required=True, help="test/faults/faults.cpp")
    parser.add_argument("--first", type=int, default=1000, help="calls that fail, one by one")
    parser.add_argument("--sampled", type=int, default=300, help="of the further ones")
    arguments = parser.parse_args()
    problems = 0
    with tempfile.TemporaryDirectory() as folder:
        reconstruction = Reconstruction(arguments.reconstruct, arguments.library, folder)
        for call in CALLS:
            most = count_calls(reconstruction, call)
            if most == 0:
                print("%s: never called, so nothing is tested" % call)
                problems += 1
            tried = 0
            for number in numbers(min(arguments.first, most), arguments.sampled, most):
                problem, met = reconstruction.run(call, number)
                tried += met
                if problem:
                    problems += 1
                    print("%s %d: %s" % (call, number, problem))
            print("%s: %d of about %d calls failed, one per run" % (call, tried, most), flush=True)
    print("%d problems" % problems)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
