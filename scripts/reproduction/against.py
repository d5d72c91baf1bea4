"""Two builds of `benchmark` in turn on one machine: what the same cells take with either."""
import json
import statistics
import subprocess

from .runs import StepFailed
from .tables import markdown_table

TIMES = {"total_ms": "total", "processor_ms": "processor", "call_ms": "in integrate()",
         "fetch_ms": "fetch"}


def run_once(program, command, report):
    """The figures of one run that are compared."""
    done = subprocess.run([str(part) for part in [program, *command, "--report", report]],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise StepFailed(f"{program}: {done.stderr.strip().splitlines()[-1:]}")
    figures = json.loads(report.read_text())
    run = {time: figures[time]["median"] for time in TIMES if time in figures}
    run["stages"] = {stage["stage"]: stage["ms"]["median"] for stage in figures["stages"]}
    return run


def run_in_turn(baseline, program, command, rounds, folder):
    """Runs of both builds, a round after the other and in the opposite order every second time:
    what else the machine does hits both."""
    runs = {"baseline": [], "this": []}
    builds = [("baseline", baseline), ("this", program)]
    for turn in range(rounds):
        for build, path in builds[::-1] if turn % 2 else builds:
            runs[build].append(run_once(path, command, folder / f"{build}.json"))
    return runs


def middle(times):
    """An older build may lack the time."""
    known = [time for time in times if time is not None]
    return f"{statistics.median(known):.3g}" if known else "–"


def ratio(before, now):
    """The median of the rounds' ratios."""
    pairs = [(old, new) for old, new in zip(before, now) if old and new and old > 0.01]
    return f"{statistics.median(new / old for old, new in pairs):.2f}" if pairs else "–"


def row_of(name, runs):
    row = [name]
    for time in TIMES:
        before, now = ([run.get(time) for run in runs[build]] for build in ("baseline", "this"))
        row += [middle(before), middle(now), ratio(before, now)]
    return row


def stage_rows(cells):
    """Stages by cells; builds may name them differently."""
    names = []
    for runs in cells.values():
        for build in ("baseline", "this"):
            names += [name for name in runs[build][0]["stages"] if name not in names]
    rows = []
    for name in names:
        row = [name]
        for runs in cells.values():
            times = [[run["stages"][name] for run in runs[build] if name in run["stages"]]
                     for build in ("baseline", "this")]
            row.append(" / ".join(f"{statistics.median(t):.3g}" if t else "–" for t in times))
        rows.append(row)
    return rows


def page(cells, rounds, made, commits):
    """`commits` says which are compared, in a sentence; it may be empty."""
    head = ["cell"]
    for name in TIMES.values():
        head += [f"{name}: baseline", "this", "ratio"]
    return "\n".join([
        "# This build against another\n",
        f"{made}\n{commits} In turn on one machine, {rounds} rounds; ms, medians over the rounds of "
        "a run's median frame; ratios are medians of the rounds' ratios. Total: from upload to "
        "updated mesh. Processor: the time of all threads in it, which other work on the machine "
        "changes least.\n",
        markdown_table(head, [row_of(name, runs) for name, runs in cells.items()]),
        "\n## Stages\n\nBaseline / this, of runs of their own with the profile on.\n",
        markdown_table(["stage", *cells], stage_rows(cells)), ""])
