"""Checks that maps of analytic scenes contain the observed surfaces, and nothing else.

Runs the program prove_scenes, which fuses views of each scene at several voxel sizes. Fills
scenes.md with the measurements outside their limits. Exits with 0 only if there are none.
"""
import os
import re

from .common import fill_page, made_by, make_parser, run


def main():
    parser = make_parser(__doc__)
    add = parser.add_argument
    add("--width", type=int, default=320, help="width of the images of the room scenes (default: %(default)s)")
    add("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="number of cases to run at the same time")
    options = parser.parse_args()
    output = run(options.programs / "prove_scenes", "--voxels", "20,10,5", "--width", options.width,
                 "--jobs", options.jobs, "--backend", options.backend, "--threads", 1)
    table, _, end = output.partition("\n\n")
    print(table)
    lines = table.splitlines()
    broken = "\n".join(lines[:2] + [line for line in lines[2:] if "**" in line])
    kept, device = end.strip().split("\nDevice: ")
    fill_page(options.results / "scenes.md", scenes=f"{broken}\n\n{kept}\n\n{made_by(device)}")
    if any(count != total for count, total in re.findall(r"(\d+) of (\d+) at", kept)):
        return "some measurements are outside their limits"
    return 0
