#!/usr/bin/env python3
"""That a soak is watched to its end."""
import pathlib
import sys
import threading
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from soaking import scenario  # noqa: E402


class FakeRecord:
    def __init__(self):
        self.problems = []

    def problem(self, what):
        self.problems.append(what)


class WatchTest(unittest.TestCase):
    def test_an_error_of_the_watcher_ends_the_run_and_is_a_problem(self):
        made = scenario.Watch.__new__(scenario.Watch)  # without a graph
        made.record, made.ended = FakeRecord(), threading.Event()

        def sample():
            raise ValueError("no such file")
        made.sample = sample
        made.sample_all(0.001)
        self.assertTrue(made.ended.is_set())
        self.assertEqual(made.record.problems, ["sampling ended: ValueError: no such file"])


if __name__ == "__main__":
    unittest.main()
