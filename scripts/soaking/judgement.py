"""Judges a record: whether memory is flat, and whether any problem was recorded."""
import json
import math
import statistics

import numpy as np

# Student's t for 95 % (two-sided), by degrees of freedom; T_95_MANY beyond the end of the list.
T_95 = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13]
T_95_MANY = 2.0
# Memory is flat if it grows per hour by at most the larger of FLAT_MB_H (in MiB) and FLAT_SHARE_H times the
# resident memory. In addition, the upper confidence bound of the growth must not exceed the larger of this
# limit and DOUBT_SHARE_H times the resident memory.
FLAT_MB_H, FLAT_SHARE_H, DOUBT_SHARE_H = 10.0, 0.05, 0.2


def read(folder):
    return [json.loads(line) for line in (folder / "record.jsonl").read_text().splitlines()]


def of_kind(records, kind):
    return [record for record in records if record["kind"] == kind]


def minima_of_cycles(records):
    """Returns (start in s, minimum memory) for each cycle in the second half. Unlike temporary memory, a leak
    raises the minima. The first half does not count, as pools and caches still grow there."""
    begins = [record["t"] for record in of_kind(records, "event") if record["what"] == "cycle"]
    samples = of_kind(records, "sample")
    least = []
    for begin, end in list(zip(begins, begins[1:] + [math.inf]))[(len(begins) + 1) // 2:]:
        values = [s["rss_mb"] for s in samples if begin <= s["t"] < end]
        if values:
            least.append((begin, min(values)))
    return least


def slope_per_hour(points):
    """Fits a line to the points. Returns its slope and the bound of the slope's error, or None for fewer than
    three points."""
    if len(points) < 3:
        return None
    line, variances = np.polyfit(*zip(*points), 1, cov=True)
    freedom = len(points) - 2
    t_95 = T_95[freedom - 1] if freedom <= len(T_95) else T_95_MANY
    return 3600.0 * float(line[0]), 3600.0 * t_95 * math.sqrt(variances[0][0])


def judge_memory(records):
    least = minima_of_cycles(records)
    values = [sample["rss_mb"] for sample in of_kind(records, "sample")]
    if not values:
        return None
    result = dict(median=round(statistics.median(values), 1), most=max(values), cycles=len(least))
    fit = slope_per_hour(least)
    if fit is None:
        return dict(result, verdict="too short to tell")
    slope, bound = fit
    limit = max(FLAT_MB_H, FLAT_SHARE_H * result["median"])
    verdict = "too short to tell"
    if slope - bound > limit:
        verdict = "grows"
    elif slope <= limit and slope + bound <= max(limit, DOUBT_SHARE_H * result["median"]):
        verdict = "flat"
    return dict(result, slope_mb_h=round(slope, 1), bound_mb_h=round(bound, 1),
                limit_mb_h=round(limit, 1), verdict=verdict)


def judge_calls(records):
    services = {}
    for call in of_kind(records, "call"):
        counts = services.setdefault(call["service"], dict(done=0, refused=0, failed=0, most_s=0.0))
        counts[call["outcome"]] += 1
        counts["most_s"] = max(counts["most_s"], call["took_s"])
    return services


def judge(records):
    problems = [dict(t=record["t"], what=record["what"]) for record in of_kind(records, "problem")]
    if not of_kind(records, "sample"):
        problems.append(dict(t=None, what="nothing was recorded"))
    rss = judge_memory(records)
    exit_code = {"flat": 0, "too short to tell": 2}.get(rss["verdict"] if rss else "", 1)
    if problems:
        exit_code = 1
    verdict = {0: "memory is flat, nothing failed", 1: "failed: see problems and memory",
               2: "nothing failed; too short to tell whether memory is flat"}[exit_code]
    return dict(
        seconds=records[-1]["t"] if records else 0.0,
        cycles=sum(record["what"] == "cycle" for record in of_kind(records, "event")),
        rss=rss, calls=judge_calls(records), problems=problems, exit_code=exit_code, verdict=verdict)
