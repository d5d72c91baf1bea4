#!/usr/bin/env python3
"""Tests that the verdict on a soak test distinguishes leaks from temporary memory use."""
import math
import pathlib
import random
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from soaking import judgement  # noqa: E402

CYCLE_S = 300.0


def records(kept_mb, cycles=12, spread_mb=1.0):
    """Simulated record of a soak test. The process permanently uses kept_mb(t) MB, plus up to spread_mb MB that
    vary between cycles. In each cycle, it temporarily uses up to 200 MB more."""
    rng, record = random.Random(7), []
    for cycle in range(cycles):
        begin = cycle * CYCLE_S
        record.append(dict(kind="event", what="cycle", t=begin))
        busy_s = rng.uniform(30.0, 250.0)
        extra_mb = spread_mb * rng.random()
        for k in range(60):
            t = begin + 5.0 * k
            busy_mb = 200.0 * rng.random() if 5.0 * k < busy_s else 0.0
            record.append(dict(kind="sample", t=t, rss_mb=kept_mb(t) + busy_mb + extra_mb))
    return record


class JudgementTest(unittest.TestCase):
    def verdict(self, kept_mb, **options):
        return judgement.judge_memory(records(kept_mb, **options))["verdict"]

    def test_temporary_memory_is_flat(self):
        self.assertEqual(self.verdict(lambda t: 150.0), "flat")

    def test_pools_that_fill_at_first_are_flat(self):
        self.assertEqual(self.verdict(lambda t: 150.0 - 60.0 * math.exp(-t / 400.0)), "flat")

    def test_a_leak_grows(self):
        self.assertEqual(self.verdict(lambda t: 150.0 + 25.0 * t / 3600.0), "grows")

    def test_a_leak_grows_even_while_pools_fill(self):
        self.assertEqual(self.verdict(
            lambda t: 150.0 - 60.0 * math.exp(-t / 400.0) + 25.0 * t / 3600.0), "grows")

    def test_a_leak_hidden_by_noise_is_not_flat(self):
        for spread_mb in (1.0, 2.0, 5.0, 10.0):
            self.assertNotEqual(
                self.verdict(lambda t: 350.0 + 40.0 * t / 3600.0, spread_mb=spread_mb), "flat")

    def test_few_cycles_give_no_verdict(self):
        self.assertEqual(self.verdict(lambda t: 150.0, cycles=4), "too short to tell")


if __name__ == "__main__":
    unittest.main()
