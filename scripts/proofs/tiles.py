"""Shows that a map in tiles has the bytes of one process, with any number of processes.

Of each case: reconstruct, tiles plan, and tiles run under mpirun for each number of workers; the
mesh and the map file have to be the same bytes. Writes the
table to out/tiles/tiles.md. Exits 0 only if all are equal.

A case is NAME@TILE_M@FRAMES@SETTINGS, FRAMES as reconstruct --frames takes them, or nothing;
SETTINGS as --set has them, between commas. NAME is a recording of DATA/sequences, or a path.
"""
import json
import os
import pathlib
import shutil
import time

from .common import ROOT, fill_page, made_by, make_parser, markdown_table, run, words

WITH_ALL = ("colour/exposure=fixed,colour/max_depth_m=3,colour/max_rate_hz=0.5,space/enabled=true,"
            "space/max_range_m=3")
CASES = ["redkitchen@1@::6@colour/enabled=never", "redkitchen@2@::6@colour/enabled=never",
         "redkitchen@2@::30@" + WITH_ALL, "house_noisy@5@::2@map/voxel_size_m=0.05"]
COLUMNS = ["recording", "frames", "tile m", "tiles", "tiles a frame", "workers", "reconstruct s",
           "plan s", "tiles s", "merge s", "peak MB", "same bytes"]


def seconds(command, **more):
    start = time.monotonic()
    run(*command, **more)
    return time.monotonic() - start


def measure(case, options):
    """A row for each number of workers."""
    name, tile_m, frames, settings = case.split("@")
    recording = pathlib.Path(name)
    if not recording.exists():
        recording = options.data / "sequences" / name
    work = options.work / f"{recording.name}_{tile_m}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    common = ["--backend", options.backend, "--threads", options.threads]
    fused = common + (["--frames", frames] if frames else [])
    for setting in words(settings):
        fused += ["--set", setting]
    one = seconds([options.programs / "reconstruct", recording, *fused, "--poses-mode", "tf",
                   "--mesh", work / "one.ply", "--save-map", work / "one.dtsdf"])
    tiles = options.programs / "tiles"
    run(tiles, "plan", recording, *fused, "--tile-m", tile_m, "--out", work / "plan")
    as_root = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    rows = []
    for workers in words(options.workers):
        shutil.rmtree(work / "plan/tiles", ignore_errors=True)
        run("mpirun", "-n", workers, "--oversubscribe", "--bind-to", "none", tiles, "run",
            work / "plan", *common, "--mesh", work / "all.ply", "--save-map", work / "all.dtsdf",
            env=as_root)
        report = json.loads((work / "plan/report.json").read_text())
        plan = json.loads((work / "plan/plan.json").read_text())
        equal = all((work / f"one{suffix}").read_bytes() == (work / f"all{suffix}").read_bytes()
                    for suffix in (".ply", ".dtsdf"))
        count = sum(last - first + 1 for r in plan["recordings"] for first, last in r["fused"])
        shared = sum(tile["frames"] for tile in report["tiles"])
        peak = max(tile["peak_bytes"] for tile in report["tiles"])
        rows.append([recording.name, count, tile_m, len(plan["tiles"]), f"{shared / count:.1f}",
                     workers, f"{one:.1f}", f"{plan['seconds']:.1f}", f"{report['fuse_s']:.1f}",
                     f"{report['merge']['seconds']:.1f}", f"{peak / 1e6:.0f}",
                     "yes" if equal else "NO"])
    return rows


def main():
    parser = make_parser(__doc__, "tiles", "sequences/")
    parser.set_defaults(backend="cpu", results=ROOT / "out" / "tiles")
    parser.add_argument("--threads", default="1", help="of reconstruct, of the plan and of a tile")
    parser.add_argument("--workers", default="1,2,4")
    parser.add_argument("cases", nargs="*", default=CASES)
    options = parser.parse_args()
    rows = [row for case in options.cases for row in measure(case, options)]
    fill_page(options.results / "tiles.md",
              tiles=f"{markdown_table(COLUMNS, rows)}\n{made_by(options.backend)}")
    return 0 if all(row[-1] == "yes" for row in rows) else 1
