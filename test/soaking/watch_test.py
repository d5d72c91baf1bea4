#!/usr/bin/env python3
"""That a soak is watched to its end, and that what is no latency is counted, not lost."""
import math
import pathlib
import struct
import sys
import threading
import types
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from soaking import scenario  # noqa: E402


class FakeRecord:
    def __init__(self):
        self.problems = []

    def problem(self, what):
        self.problems.append(what)


def watch(oldest_s=math.inf, now_s=1000.0):
    """One without a graph: what a Watch is before anything has come."""
    made = scenario.Watch.__new__(scenario.Watch)
    now = types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_sec=lambda: now_s))
    made.rospy, made.record = types.SimpleNamespace(Time=now), FakeRecord()
    made.ended, made.oldest_s = threading.Event(), oldest_s
    made.latencies_s, made.left_out, made.newest_stamp = [], 0, 0.0
    return made


def mesh_of(stamp_s):
    """A message that begins with a header: number, seconds, nanoseconds."""
    return struct.pack("<III", 0, int(stamp_s), int(stamp_s % 1.0 * 1e9))


class WatchTest(unittest.TestCase):
    def test_an_error_of_the_watcher_ends_the_run_and_is_a_problem(self):
        made = watch()

        def sample():
            raise ValueError("no such file")
        made.sample = sample
        made.sample_all(0.001)
        self.assertTrue(made.ended.is_set())
        self.assertEqual(made.record.problems, ["sampling ended: ValueError: no such file"])

    def test_slow_meshes_of_a_live_camera_count(self):
        made = watch()
        for stamp_s in (0.0, 900.0, 900.0, 999.5):
            made.on_blocks(mesh_of(stamp_s))
        self.assertEqual(made.latencies_s, [100.0, 0.5])
        self.assertEqual(made.left_out, 0)

    def test_of_a_bag_what_is_of_another_time_is_counted_apart(self):
        made = watch(scenario.OLDEST_OF_BAG_S)
        for stamp_s in (900.0, 1001.0, 999.5):
            made.on_blocks(mesh_of(stamp_s))
        self.assertEqual(made.latencies_s, [0.5])
        self.assertEqual(made.left_out, 2)


if __name__ == "__main__":
    unittest.main()
