"""Compares the colours of reconstructed models with the ground truth.

Renders each model from 60 views along a helix, and a furnished house from inside, with a checker and a
gradient texture; the colour camera is 5 cm from the depth camera. Reconstructs each and measures the
colour error over the surface. Does the same for a 5 mm plate, red in front and blue behind, with
the directional and the undirected map. Writes tables and pictures to colour.md. Exits with 0 only
if the directional map does not mix the plate's colours.
"""
import itertools
import json

import numpy as np

from .common import (MAPS, fill_page, made_by, make_parser, markdown_table, number, reconstruct,
                     render, run)
from .ply import columns, read_ply

TEXTURES = ("checker", "gradient")
HOUSE = "house"  # furnished; rendered from inside, at the poses of house_noisy
# {model: voxel sizes in mm}.
MODELS = {"armadillo": [10, 20], "dragon": [10, 20], HOUSE: [25, 50]}
PLATE_VOXELS_MM, FRAMES = [10, 20], 60

PLATE_M = (0.005, 0.5, 0.5)
FRONT, BACK, RIM = (220, 30, 30), (30, 30, 220), (128, 128, 128)
MAX_WRONG_SHARE = 0.01  # limit for wrong_share()


def write_plate(path):
    """Writes a box. Its faces share no vertices, so that each can have its own colour."""
    rows = []
    for axis, sign in itertools.product(range(3), (1, -1)):
        colour = RIM if axis > 0 else FRONT if sign > 0 else BACK
        for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))[::sign]:
            rows.append([*(0.5 * np.roll((sign, s, t), axis) * PLATE_M), *colour])
    with open(path, "w", encoding="utf-8") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 24\nproperty float x\nproperty float y\nproperty float z\n"
                   "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 6\n"
                   "property list uchar int vertex_indices\nend_header\n")
        np.savetxt(file, rows, "%g")
        np.savetxt(file, [[4, *range(i, i + 4)] for i in range(0, 24, 4)], "%d")


def wrong_share(mesh, voxel_mm):
    """Fraction of the vertices more than a voxel away from the rim that have the colour of another side."""
    vertices = read_ply(mesh)[0]
    inside = (abs(columns(vertices, "yz")) <= np.array(PLATE_M[1:]) / 2 - voxel_mm / 1000).all(axis=1)
    vertices = vertices[inside]
    off = columns(vertices, ("red", "green", "blue"))[:, None] - np.array([FRONT, BACK, RIM], float)
    return np.mean(np.square(off).sum(axis=2).argmin(axis=1) != (vertices["nx"] <= 0))


def measure_plate(options, voxel_mm, variant):
    """Renders pictures of both sides, and returns wrong_share()."""
    mesh = options.work / f"plate_{variant}_{voxel_mm:g}mm.ply"
    reconstruct(options, options.work / "plate", voxel_mm, MAPS[variant], mesh)
    for side, azimuth in (("front", 60), ("back", 240)):
        run(options.programs / "render_mesh", mesh,
            options.results / f"colour_plate_{variant}_{side}.png", f"--view={azimuth},20",
            "--width", 300, "--height", 300)
    return wrong_share(mesh, voxel_mm)


def plate(options):
    """Returns the text for the part `plate`, and whether the directional map keeps the colours apart."""
    write_plate(options.work / "plate.ply")
    render(options, (options.work / "plate.ply").resolve(), options.work / "plate", "--frames",
           FRAMES, "--trajectory", "sphere", "--radius", 1, "--longest-side", 0,
           "--colour", "vertices")
    rows, is_sound = [], True
    for voxel_mm in PLATE_VOXELS_MM:
        shares = {variant: measure_plate(options, voxel_mm, variant) for variant in MAPS}
        rows.append([f"{voxel_mm:g}"] + [f"{share:.2%}" for share in shares.values()])
        is_sound = is_sound and shares["directional"] < MAX_WRONG_SHARE
    pictures = [f"![](colour_plate_{variant}_{side}.png)"
                for variant in MAPS for side in ("front", "back")]
    return (f"{markdown_table(['voxel mm', *MAPS], rows)}\nFront and back at "
            f"{PLATE_VOXELS_MM[-1]:g} mm, directional left, undirected right:\n\n"
            + " ".join(pictures)), is_sound


def compare(options, model, texture, voxel_mm):
    """Measures a model and returns its row of the table."""
    path, shown = f"models/{model}.ply", ["--frames", FRAMES, "--trajectory", "helix"]
    if model == HOUSE:
        path = "scenes/house.ply"
        shown = ["--frames", 200, "--views", options.data / "sequences" / "house_noisy"]
    folder = render(options, path, options.work / f"{model}_{texture}", *shown, "--colour", texture)
    mesh = options.work / f"{model}_{texture}_{voxel_mm:g}mm.ply"
    report = reconstruct(options, folder, voxel_mm, [], mesh)
    found = json.loads(run(options.programs / "evaluate_mesh", mesh, folder / "gt.ply", "--colour",
                           texture, "--samples", 200000))
    errors = [number(found[key]) for key in ("rmse_rgb", "rmse_lab", "median_lab")]
    without = report["map_bytes"] - report["colour_bytes"]
    return [model, f"{voxel_mm:g}", texture, *errors, f"{report['map_bytes'] / without:.2f}"]


def main():
    parser = make_parser(__doc__, "colour", "models/, scenes/ and sequences/")
    parser.set_defaults(backend="cpu")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rows = [compare(options, model, texture, voxel_mm) for model, voxels in MODELS.items()
            for voxel_mm in voxels for texture in TEXTURES]
    header = ["model", "voxel mm", "texture", "RMSE in RGB", "RMSE in Lab", "median in Lab", "map"]
    plate_text, is_sound = plate(options)
    fill_page(options.results / "colour.md", plate=plate_text,
              models=f"{markdown_table(header, rows)}\n{made_by(options.backend)}")
    return 0 if is_sound else "the directional map mixes the colours of the plate's sides"
