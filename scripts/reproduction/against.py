"""Two builds of `benchmark` in turn on one machine: what the same cells take with either."""
import json
import statistics
import subprocess

from .runs import StepFailed
from .tables import markdown_table

TIMES = ("total_ms", "call_ms", "fetch_ms")


def run_once(program, command, report):
    """The figures of one run that are compared."""
    done = subprocess.run([str(part) for part in [program, *command, "--report", report]],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise StepFailed(f"{program}: {done.stderr.strip().splitlines()[-1:]}")
    figures = json.loads(report.read_text())
    run = {time: figures[time]["median"] for time in TIMES}
    run["stages"] = {stage["stage"]: stage["ms"]["median"] for stage in figures["stages"]}
    return run


def run_in_turn(baseline, program, command, rounds, folder):
    """Runs of both builds, a round after the other: what else the machine does hits both."""
    runs = {"baseline": [], "this": []}
    for _ in range(rounds):
        for build, path in (("baseline", baseline), ("this", program)):
            runs[build].append(run_once(path, command, folder / f"{build}.json"))
    return runs


def middle(runs, time):
    return statistics.median(run[time] for run in runs)


def row_of(name, runs):
    row = [name]
    for time in TIMES:
        before, now = (middle(runs[build], time) for build in ("baseline", "this"))
        row += [f"{before:.3g}", f"{now:.3g}", f"{now / before:.2f}" if before > 0.01 else "–"]
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
    for time in ("total", "in integrate()", "fetch"):
        head += [f"{time}: baseline", "this", "ratio"]
    return "\n".join([
        "# This build against another\n",
        f"{made}\n{commits} In turn on one machine, {rounds} rounds; ms, medians over the rounds of "
        "a run's median frame. Total: from upload to updated mesh.\n",
        markdown_table(head, [row_of(name, runs) for name, runs in cells.items()]),
        "\n## Stages\n\nBaseline / this, of runs of their own with the profile on.\n",
        markdown_table(["stage", *cells], stage_rows(cells)), ""])
