"""Compares three ways of correcting a map after its poses have been corrected.

A camera moves through a house. Its poses drift like odometry, and are then corrected to the true poses.
The map is corrected in these ways:
- All images are fused again at the true poses, as in the node and in `reconstruct JOURNAL --poses`.
- Submaps, fused at drifted poses, are moved to the true poses of their first images, as in voxgraph.
- Only one image a second is fused, at its true pose, as in rtabmap.
The last two are emulated with maps of this package. Fills the part `corrections` of poses.md, and saves
pictures of the meshes in --work. Needs numpy.
"""
import json

import numpy as np

from .common import fill_page, made_by, make_parser, markdown_table, number, reconstruct, render, run, words
from .ply import columns, read_ply

# {way: (images per part, images from the start of a part to the start of the next)}, capped at --images.
WAYS = {"not corrected": (10**6, 10**6), "**fused again**": (10**6, 10**6), "submaps of 5 s, moved": (150, 150),
        "submaps of 1 s, moved": (30, 30), "one image a second, moved": (1, 30)}
STEP_M, STEP_DEG = 0.002, 0.05  # standard deviations per image: about 5 cm and 1 degree after 20 s


def drift(truth, seed, restart):
    """Returns the rows of a TUM file with added drift. Every `restart` rows, the drift restarts at zero."""
    rng, poses = np.random.default_rng(seed), truth.copy()
    for i, row in enumerate(poses):
        if i % restart == 0:
            angle, before = 0.0, i
            row_m = truth[i, 1:4]
        else:
            angle += np.radians(rng.normal(0, STEP_DEG))
            turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
            row_m = row_m + turn @ (truth[i, 1:4] - truth[before, 1:4]) + rng.normal(0, STEP_M, 3)
            before = i
        s, c = np.sin(angle / 2), np.cos(angle / 2)
        x, y, z, w = truth[i, 4:8]
        row[1:] = *row_m, c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z
    return poses


def join(meshes, path):
    """Writes several meshes as one."""
    parts = [read_ply(mesh) for mesh in meshes]
    vertices = np.concatenate([columns(part, "xyz") for part, _ in parts]).astype("<f4")
    firsts = np.cumsum([0] + [len(part) for part, _ in parts])
    triangles = np.concatenate([part + first for (_, part), first in zip(parts, firsts)])
    faces = np.array([(3, row) for row in triangles], [("n", "u1"), ("v", "<u4", 3)])
    path.write_bytes(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\n"
                     f"property float y\nproperty float z\nelement face {len(faces)}\n"
                     "property list uchar int vertex_indices\nend_header\n".encode() + vertices.tobytes() + faces.tobytes())


def measure(options, seed):
    """Returns the RMSE of the surface in mm for each way."""
    count, errors = options.images, []
    folder = render(options, "scenes/house.ply", options.work / f"hand_{count}_{seed}", "--trajectory", "hand", "--views",
                    options.data / "sequences/house_noisy", "--frames", count, "--noise", "kinect", "--longest-side", 0,
                    "--seed", seed)
    truth = np.loadtxt(folder / "groundtruth.txt")
    for name, (length, step) in WAYS.items():
        length, step = min(length, count), min(step, count)
        poses, mesh = options.work / "poses.txt", options.work / f"{name.strip('*').split(',')[0].replace(' ', '_')}.ply"
        np.savetxt(poses, truth if "again" in name else drift(truth, seed, step), fmt="%.9f")
        parts = []
        for first in range(0, count, step):
            parts.append(options.work / f"part_{first}.ply")
            settings = ["colour/enabled=never", "fusion/max_depth_m=4", f"mesh/min_support={min(length, 2)}"]
            reconstruct(options, folder, options.voxel_mm, settings, parts[-1], "--poses", poses, "--frames",
                        f"{first}:{first + length - 1}")
        join(parts, mesh)
        found = json.loads(run(options.programs / "evaluate_mesh", mesh, folder / "gt.ply"))
        errors.append(number(found["surface"]["rmse_mm"]))
        run(options.programs / "render_mesh", mesh, mesh.with_suffix(".png"), "--plain", "--views", folder, "--image",
            count // 2)
    return errors


def main():
    parser = make_parser(__doc__, "corrections", "scenes/ and sequences/")
    parser.add_argument("--voxel-mm", type=float, default=20.0, help="voxel size (default: %(default)s)")
    parser.add_argument("--images", type=int, default=600, help="number of images, 30 per second (default: %(default)s)")
    parser.add_argument("--seeds", default="1,2", help="seeds for path, noise and drift (default: %(default)s)")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    seeds = words(options.seeds)
    columns = [measure(options, int(seed)) for seed in seeds]
    table = markdown_table(["map", *(f"seed {seed}" for seed in seeds)], zip(WAYS, *columns))
    fill_page(options.results / "poses.md", corrections=f"{table}\n{made_by(options.backend)}")
    return 0
