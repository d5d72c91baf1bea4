#!/usr/bin/env python3
"""Runs `reconstruct` repeatedly. In each run, one system call or allocation fails: first each of the early
calls, then a sample of the later ones. `reconstruct` must continue or end with an error message, and each
output file must then be complete or unchanged.

Calls are counted from when the recording or the map to load is opened. Before that, during startup, the
program may end silently if memory runs out."""

import argparse
import concurrent.futures
import os
import queue
import random
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import tum_folder

WIDTH, HEIGHT, FRAMES = 64, 48, 3
OLD = b"what was there before\n"


def write_recording(folder):
    """Writes a recording of a wall with a step, from a stationary camera."""
    row = struct.pack(">H", 5000) * 30 + struct.pack(">H", 4000) * (WIDTH - 30)
    image = tum_folder.png([row] * HEIGHT)
    tum_folder.write(
        folder, [(f"{i + 1}.0", image, (0, 0, 0, 0, 0, 0, 1)) for i in range(FRAMES)])


class Case:
    """A command, and the file whose opening starts the count of calls."""

    def __init__(self, name, calls, begins_at, outputs, arguments):
        self.name = name
        self.calls = calls
        self.begins_at = begins_at  # part of the name of the file that starts the count
        self.outputs = outputs      # names in the output folder
        self.arguments = arguments


def cases(out, base_map):
    """The two cases: extracting a mesh from a recording, and loading, extending and saving a map."""
    mesh, map_file = os.path.join(out, "mesh.ply"), os.path.join(out, "map.dtsdf")
    return [
        Case("mesh", ["open", "read", "write", "fsync", "rename", "allocate"], "depth.txt",
             ["mesh.ply"], ["--mesh", mesh]),
        Case("map", ["open", "read", "write", "fsync", "rename", "allocate"],
             os.path.basename(base_map), ["map.dtsdf", "mesh.ply"],
             ["--load-map", base_map, "--save-map", map_file, "--mesh", mesh]),
    ]


class Reconstruction:
    """Runs `reconstruct` with a fault."""

    def __init__(self, command, library, folder, case):
        self.library = library
        self.case = case
        self.out = os.path.join(folder, "out")
        os.makedirs(self.out, exist_ok=True)
        self.met = os.path.join(folder, "met")
        self.command = command + case.arguments
        self.clear_outputs()
        run_without_fault(self.command)
        self.new = {name: self.read(name) for name in case.outputs}

    def read(self, name):
        with open(os.path.join(self.out, name), "rb") as output:
            return output.read()

    def clear_outputs(self):
        for left in os.listdir(self.out):
            os.remove(os.path.join(self.out, left))

    def run(self, call, number):
        """Returns the problem after this fault ("" for none), and whether the fault occurred."""
        self.clear_outputs()
        for name in self.case.outputs:
            with open(os.path.join(self.out, name), "wb") as output:
                output.write(OLD)
        if os.path.exists(self.met):
            os.remove(self.met)
        environment = dict(os.environ, LD_PRELOAD=self.library, DTSDF_FAULT_MET=self.met,
                           DTSDF_FAULT="%s:%d" % (call, number),
                           DTSDF_FAULT_FROM=self.case.begins_at)
        try:
            done = subprocess.run(self.command, capture_output=True, text=True, env=environment,
                                  timeout=600)
        except subprocess.TimeoutExpired:
            return "timeout", True
        return self.problem(done), os.path.exists(self.met)

    def problem(self, done):
        if done.returncode < 0:
            said = " ".join(done.stderr.split())[-300:]
            return "ended by signal %d: %s" % (-done.returncode, said)
        if done.returncode > 0 and not done.stderr.strip():
            return "exit code %d without a message" % done.returncode
        for name in self.case.outputs:
            content = self.read(name)
            if content not in (OLD, self.new[name]):
                return "%s is neither the earlier file nor the complete new one" % name
            if done.returncode == 0 and content != self.new[name]:
                return "exit code 0, but %s is the earlier file" % name
        left = sorted(os.listdir(self.out))
        if left != sorted(self.case.outputs):
            return "missing or unexpected files; the folder contains %s" % left
        return ""


def run_without_fault(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("reconstruct fails without any fault: " + done.stderr)


def numbers(first, sampled, most):
    """Yields the indices of the first calls, counted from 1, then a sample of those up to `most`."""
    yield from range(1, first + 1)
    if most > first:
        rest = range(first + 1, most + 1)
        yield from sorted(random.Random(1).sample(rest, min(sampled, len(rest))))


def count_calls(reconstruction, call):
    """Finds the number of calls by bisection: beyond this number, no fault occurs."""
    low, high = 0, 1
    while reconstruction.run(call, high)[1]:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if reconstruction.run(call, middle)[1] else (low, middle)
    return low


def run_each(reconstructions, call, tried):
    """Yields (number, problem, whether the fault occurred), with one run at a time per folder."""
    free = queue.SimpleQueue()
    for reconstruction in reconstructions:
        free.put(reconstruction)

    def run(number):
        reconstruction = free.get()
        try:
            return (number,) + reconstruction.run(call, number)
        finally:
            free.put(reconstruction)

    with concurrent.futures.ThreadPoolExecutor(len(reconstructions)) as pool:
        yield from pool.map(run, tried)


def try_calls(reconstructions, first, sampled):
    """Returns the number of problems."""
    problems = 0
    case = reconstructions[0].case
    for call in case.calls:
        most = count_calls(reconstructions[0], call)
        if most == 0:
            print("%s: %s is never called, so nothing is tested" % (case.name, call))
            problems += 1
        tried = 0
        for number, problem, met in run_each(reconstructions, call,
                                             numbers(min(first, most), sampled, most)):
            tried += met
            if problem:
                problems += 1
                print("%s: %s %d: %s" % (case.name, call, number, problem))
        print("%s: %s: %d of about %d calls failed, one per run" % (case.name, call, tried, most),
              flush=True)
    return problems


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reconstruct", required=True)
    parser.add_argument("--library", required=True, help="library built from faults.cpp")
    parser.add_argument("--first", type=int, default=1000, help="fail each of the first FIRST calls")
    parser.add_argument("--sampled", type=int, default=300, help="fail a sample of SAMPLED later calls")
    parser.add_argument("--jobs", type=int, default=1, help="parallel runs (default: 1)")
    arguments = parser.parse_args()
    problems = 0
    with tempfile.TemporaryDirectory() as folder:
        recording = os.path.join(folder, "recording")
        write_recording(recording)
        command = [arguments.reconstruct, recording, "--intrinsics", "60,60,31.5,23.5", "--set",
                   "map/voxel_size_m=0.05", "--set", "poses/mode=tf", "--set", "threads=2", "--set", "backend=cpu"]
        base_map = os.path.join(folder, "before.dtsdf")
        run_without_fault(command + ["--save-map", base_map])
        places = [os.path.join(folder, str(job)) for job in range(max(1, arguments.jobs))]
        for case_of_each in zip(*(cases(os.path.join(place, "out"), base_map)
                                  for place in places)):
            reconstructions = [Reconstruction(command, arguments.library, place, case)
                               for place, case in zip(places, case_of_each)]
            problems += try_calls(reconstructions, arguments.first, arguments.sampled)
    print("%d problems" % problems)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
