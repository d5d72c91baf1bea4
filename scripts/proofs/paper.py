"""Runs the paper's experiments: accuracy by model, voxel size and fusion mode.

For each table cell, renders an orbit, reconstructs a mesh, and compares it with the model. Reuses meshes
that are newer than the program, so that an interrupted run can continue. Fills the part of
accuracy.md that is named after the set-up.
"""
import json
import re

from .common import (fill_page, made_by, make_parser, markdown_table, number, numbers, reconstruct,
                     render, run, words)

MODES = {f"{'directional' if directional == 'true' else 'undirected'}-{short}":
         [f"map/directional={directional}", f"fusion/mode={mode}"]
         for directional in ("true", "false")
         for short, mode in (("rcn", "normal_ray_casting"), ("rc", "ray_casting"),
                             ("vp", "voxel_projection"))}
MODELS = ["armadillo", "asian_dragon", "bunny", "dragon"]
HOUSE = "house_noisy"  # a recording used in place of the paper's rooms


def setup_of(options):
    """The name of the set-up, which lists its differences from the paper; "paper" if there are none."""
    parts = [] if options.frames == 1000 else [f"{options.frames}_frames"]
    parts += [name for name in (options.trajectory, options.noise) if name not in ("circle", "none")]
    parts += [setting.split("/")[-1] for setting in options.set]
    return re.sub("[^a-z0-9]+", "_", "_".join(parts)) or "paper"


def measure(options, model, voxel_mm, mode):
    """Returns a table cell (RMSE in mm of vertices, surface and completeness) and the mesh's topology."""
    folder = options.work / model
    truth = folder / "gt.ply"
    if model == HOUSE:
        folder = options.data / "sequences" / HOUSE
        truth = options.data / "scenes" / "house.ply"
    mesh = options.work / f"{model}_{voxel_mm:g}mm_{mode}.ply"
    program = options.programs / "reconstruct"
    if not mesh.exists() or mesh.stat().st_mtime < program.stat().st_mtime:
        reconstruct(options, folder, voxel_mm, MODES[mode] + options.set, mesh)
    found = json.loads(run(options.programs / "evaluate_mesh", mesh, truth, "--views", folder))
    triple = " / ".join(number(found[part]["rmse_mm"])
                        for part in ("vertices", "surface", "completeness"))
    if model == HOUSE:
        triple += f", F {found['f_scores'][-1]['f_score']:.3f}"
    return triple, found["topology"]


def main():
    parser = make_parser(__doc__, "paper", "models/, scenes/ and sequences/")
    add = parser.add_argument
    add("--models", type=words, default=MODELS, help=f"models, separated by commas; also {HOUSE}")
    add("--voxels", type=numbers, default=[5, 10, 20, 50], help="voxel sizes in mm (default: %(default)s)")
    add("--modes", type=words, default=["directional-rcn", "undirected-vp"],
        help=f"modes, separated by commas: {', '.join(MODES)}")
    add("--frames", type=int, default=1000, help="images per orbit (default: %(default)s)")
    add("--trajectory", default="circle", help="circle, helix or sphere (default: %(default)s)")
    add("--noise", default="none", help="as in render_orbit (default: %(default)s)")
    add("--set", action="append", default=[], metavar="KEY=VALUE", help="settings for reconstruct")
    options = parser.parse_args()
    setup = setup_of(options)
    options.work /= setup
    options.work.mkdir(parents=True, exist_ok=True)
    for model in options.models:
        if model != HOUSE:
            render(options, f"models/{model}.ply", options.work / model, "--frames", options.frames,
                   "--trajectory", options.trajectory, "--noise", options.noise)
    rows = []
    for model in options.models:
        for voxel_mm in options.voxels:
            found = [measure(options, model, voxel_mm, mode) for mode in options.modes]
            topology = found[0][1]
            rows.append([model, f"{voxel_mm:g}", *(triple for triple, _ in found),
                         topology["boundary_edges"], topology["components"]])
            print(*rows[-1], flush=True)
    header = ["model", "voxel mm", *options.modes, "boundary edges", "pieces"]
    fill_page(options.results / "accuracy.md",
              **{setup: f"{markdown_table(header, rows)}\n{made_by(options.backend)}"})
    return 0
