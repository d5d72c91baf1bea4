"""Shows that a map by boxes has the bytes of one process.

Of each case: reconstruct, then the boxes that map_tool boxes prints, by so many processes of GNU
parallel, map_tool join and map_tool mesh; the mesh and the map file have to be the same bytes. Writes
the table to out/boxes/boxes.md. Exits 0 only if all are equal.

A case is NAME@COUNT@FRAMES@SETTINGS, FRAMES as reconstruct --frames takes them, or nothing; SETTINGS
as --set has them, between commas. NAME is a recording of DATA/sequences, or a path.
"""
import pathlib
import shutil
import subprocess
import time

from .common import ROOT, fill_page, made_by, make_parser, markdown_table, run, words

WITH_ALL = ("colour/exposure=fixed,colour/max_depth_m=3,colour/max_rate_hz=0.5,space/enabled=true,"
            "space/max_range_m=3")
CASES = ["redkitchen@12@::6@colour/enabled=never", "redkitchen@4@::30@" + WITH_ALL,
         "house_noisy@8@::2@map/voxel_size_m=0.05"]
COLUMNS = ["recording", "boxes", "workers", "reconstruct s", "boxes s", "join and mesh s",
           "same bytes"]


def seconds(*command, **more):
    start = time.monotonic()
    run(*command, **more)
    return time.monotonic() - start


def measure(case, options):
    name, count, frames, settings = case.split("@")
    recording = pathlib.Path(name)
    if not recording.exists():
        recording = options.data / "sequences" / name
    work = options.work / recording.name
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    reconstruct, map_tool = options.programs / "reconstruct", options.programs / "map_tool"
    fused = ["--set", "poses/mode=tf", "--backend", options.backend, "--threads", options.threads]
    fused += ["--frames", frames] if frames else []
    for setting in words(settings):
        fused += ["--set", setting]
    one = seconds(reconstruct, recording, *fused, "--mesh", work / "one.ply", "--save-map",
                  work / "one.dtsdf")
    boxes = subprocess.run([map_tool, "boxes", recording, "--count", count, *fused], check=True,
                           text=True, stdout=subprocess.PIPE).stdout
    (work / "boxes.txt").write_text(boxes)
    made = seconds("parallel", "-j", options.workers, "--halt", "now,fail=1", "-a",
                   work / "boxes.txt", reconstruct, recording, "--only", "{}", *fused,
                   "--save-map", work / "box_{#}.dtsdf")
    joined = seconds(map_tool, "join", *sorted(work.glob("box_*.dtsdf")), "--save-map",
                     work / "all.dtsdf")
    joined += seconds(map_tool, "mesh", work / "all.dtsdf", work / "all.ply")
    equal = all((work / f"one{suffix}").read_bytes() == (work / f"all{suffix}").read_bytes()
                for suffix in (".ply", ".dtsdf"))
    return [recording.name, count, options.workers, f"{one:.1f}", f"{made:.1f}", f"{joined:.1f}",
            "yes" if equal else "NO"]


def main():
    parser = make_parser(__doc__, "boxes", "sequences/")
    parser.set_defaults(backend="cpu", results=ROOT / "out" / "boxes")
    parser.add_argument("--threads", default="1", help="of each process")
    parser.add_argument("--workers", default="2", help="processes at a time")
    parser.add_argument("cases", nargs="*", default=CASES)
    options = parser.parse_args()
    rows = [measure(case, options) for case in options.cases]
    fill_page(options.results / "boxes.md",
              boxes=f"{markdown_table(COLUMNS, rows)}\n{made_by(options.backend)}")
    return 0 if all(row[-1] == "yes" for row in rows) else 1
