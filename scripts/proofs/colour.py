"""Compares the colours of reconstructed models with the truth.

Renders each model from a helix of --frames views, and a furnished house from inside, in a checker
and in a gradient, with the colour camera 5 cm beside the depth camera, reconstructs it and measures
the error of colour over the surface. Then a plate 5 mm thick, red in front and blue behind, by the
directional and by the undirected map. Fills colour.md, with pictures of the plate. Exits 0 only if
the directional plate has its colours.
"""
import json

from .common import (MAPS, fill_page, made_by, make_parser, markdown_table, number, numbers,
                     reconstruct, render, run, words)
from .ply import read_ply

TEXTURES = ("checker", "gradient")
HOUSE = "house"  # furnished, seen from inside, by the poses of house_noisy
HOUSE_VOXELS_MM = [25, 50]

PLATE_M = (0.005, 0.5, 0.5)
FRONT, BACK, RIM = (220, 30, 30), (30, 30, 220), (128, 128, 128)
MOST_WRONG = 0.01  # of the vertices farther than a voxel from the rim


def write_plate(path):
    """A box of six faces, each with corners and a colour of its own."""
    vertices, faces = [], []
    for axis in range(3):
        for sign in (1, -1):
            colour = RIM if axis > 0 else (FRONT if sign > 0 else BACK)
            corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::sign]
            faces.append(range(len(vertices), len(vertices) + 4))
            for s, t in corners:
                place = [0.0, 0.0, 0.0]
                place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3] = sign, s, t
                vertices.append([0.5 * a * b for a, b in zip(place, PLATE_M)] + list(colour))
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property float {name}" for name in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(f"{value:g}" for value in vertex) for vertex in vertices]
    lines += ["4 " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def wrong_share(mesh, voxel_mm):
    """Of the vertices farther than a voxel from the rim: those not nearest to their side's colour."""
    inside = [half / 2 - voxel_mm / 1000 for half in PLATE_M[1:]]
    total = wrong = 0
    for v in read_ply(mesh)[0]:
        if abs(v["y"]) > inside[0] or abs(v["z"]) > inside[1]:
            continue
        own = FRONT if v["nx"] > 0 else BACK
        colour = (v["red"], v["green"], v["blue"])
        nearest = min((FRONT, BACK, RIM),
                      key=lambda c: sum((a - b) ** 2 for a, b in zip(c, colour)))
        total, wrong = total + 1, wrong + (nearest != own)
    return wrong / max(total, 1)


def measure_plate(options, voxel_mm, variant):
    """The share of wrong vertices; draws both sides into the results."""
    mesh = options.work / f"plate_{variant}_{voxel_mm:g}mm.ply"
    reconstruct(options, options.work / "plate", voxel_mm, MAPS[variant], mesh)
    for side, azimuth in (("front", 60), ("back", 240)):
        run(options.programs / "render_mesh", mesh,
            options.results / f"colour_plate_{variant}_{side}.png", f"--view={azimuth},20",
            "--width", 300, "--height", 300)
    return wrong_share(mesh, voxel_mm)


def plate(options):
    """The text on the plate, and whether the directional map keeps its colours apart."""
    write_plate(options.work / "plate.ply")
    render(options, (options.work / "plate.ply").resolve(), options.work / "plate", "--frames",
           options.frames, "--trajectory", "sphere", "--radius", 1, "--longest-side", 0,
           "--colour", "vertices")
    rows, is_sound = [], True
    for voxel_mm in options.voxels:
        shares = {variant: measure_plate(options, voxel_mm, variant) for variant in MAPS}
        rows.append([f"{voxel_mm:g}"] + [f"{share:.2%}" for share in shares.values()])
        is_sound = is_sound and shares["directional"] < MOST_WRONG
    pictures = [f"![](colour_plate_{variant}_{side}.png)"
                for variant in MAPS for side in ("front", "back")]
    return (f"{markdown_table(['voxel mm', *MAPS], rows)}\nFront and back at "
            f"{options.voxels[-1]:g} mm, directional left, undirected right:\n\n"
            + " ".join(pictures)), is_sound


def compare(options, model, texture, voxel_mm):
    """A row of the table."""
    path, shown = f"models/{model}.ply", ["--frames", options.frames, "--trajectory", "helix"]
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
    parser.add_argument("--models", type=words, default=["armadillo", "dragon", HOUSE])
    parser.add_argument("--voxels", type=numbers, default=[10, 20], help="in mm")
    parser.add_argument("--frames", type=int, default=60)
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rows = [compare(options, model, texture, voxel_mm) for model in options.models
            for voxel_mm in (HOUSE_VOXELS_MM if model == HOUSE else options.voxels)
            for texture in TEXTURES]
    header = ["model", "voxel mm", "texture", "RMSE in RGB", "RMSE in Lab", "median in Lab", "map"]
    plate_text, is_sound = plate(options)
    fill_page(options.results / "colour.md", plate=plate_text,
              models=f"{markdown_table(header, rows)}\n{made_by(options.backend)}")
    return 0 if is_sound else "the directional map mixes the colours of the plate's sides"
