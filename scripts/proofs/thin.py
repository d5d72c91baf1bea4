"""Shows that plates, or rods, 2 to 40 mm thick keep all their sides with 20 mm voxels.

Renders syn_plates.ply (or --model syn_rods) from all sides and reconstructs it with the directional and
the undirected map. Measures how complete and accurate the two faces of each plate, or the four quarters
of each rod, are. Fills thin.md and renders two pictures for it. Exits with 0 only if the directional map
keeps every side of all parts at least 10 mm thick, and the undirected map does not.
"""
import numpy as np

from .common import (MAPS, fill_page, made_by, make_parser, markdown_table, reconstruct, render,
                     run)
from .ply import columns, read_ply

FRAMES, VOXEL_MM = 300, 20.0
SQUARE_M = 0.025         # edge of the squares into which a side is divided; a square with a point is covered
INSET_M = 0.025          # width of the margin at the ends of a side, which is not measured
FACING_COSINE = 0.9      # a point belongs to a plate's face if their normals have at least this cosine
LARGEST_OFFSET_M = 0.06  # a point farther from a side does not belong to it
# A side is sound if at least this fraction of it is covered, and its mean offset is at most this large.
SOUND_SHARE, SOUND_OFFSET_M = 0.95, 0.005
MIN_SOUND_THICKNESS_M = 0.0099  # thinner parts need not be sound
# Barycentric weights of the points inside a triangle.
WEIGHTS = [(1 / 3, 1 / 3, 1 / 3), (2 / 3, 1 / 6, 1 / 6), (1 / 6, 2 / 3, 1 / 6),
           (1 / 6, 1 / 6, 2 / 3)]


class Part:
    """A plate (an axis-aligned box that is thin along one axis) or a rod along y, given by its vertices."""

    def __init__(self, points):
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        self.size = self.high - self.low
        self.axis = int(self.size.argmin())
        self.thickness_m = self.size[self.axis]
        self.is_rod = abs(self.size[0] - self.size[2]) < 1e-3

    def sides(self):
        """Returns {name: direction} for the two faces of a plate or the four quarters of a rod."""
        axes = {"x": 0, "z": 2} if self.is_rod else {"": self.axis}
        return {sign + name: (1 if sign == "+" else -1) * np.eye(3)[axis]
                for name, axis in axes.items() for sign in "+-"}

    def offsets(self, side, positions, normals):
        """Returns the signed distances of points from a side, positive in front of it, and a mask of the
        points that belong to it."""
        if not self.is_rod:
            plane = self.high if side[self.axis] > 0 else self.low
            return ((positions - plane) @ side, normals @ side >= FACING_COSINE)
        across = (positions - (self.low + self.high) / 2) * [1, 0, 1]
        faces = (normals * across).sum(axis=1) >= 0
        return (np.linalg.norm(across, axis=1) - self.thickness_m / 2,
                faces & (normals @ side >= np.sqrt(0.5)))

    def measure(self, side, positions, normals):
        """Returns the fraction of the side that is covered, and its points' mean and largest offsets."""
        along = [1] if self.is_rod else [a for a in range(3) if a != self.axis]
        offsets, chosen = self.offsets(side, positions, normals)
        inset = (positions - self.low)[:, along] - INSET_M
        lengths = self.size[along] - 2 * INSET_M
        chosen = (chosen & (abs(offsets) <= LARGEST_OFFSET_M)
                  & ((inset >= 0) & (inset <= lengths)).all(axis=1))
        if not chosen.any():
            return 0.0, np.nan, np.nan
        squares = np.unique((inset[chosen] / SQUARE_M).astype(int), axis=0)
        total = np.maximum(1, (lengths / SQUARE_M + 1e-9).astype(int)).prod()
        return (min(1.0, len(squares) / total), offsets[chosen].mean(), abs(offsets[chosen]).max())


def points_of(path):
    """Returns positions and normals of a mesh's vertices and of points inside its triangles."""
    vertices, triangles = read_ply(path)
    positions, normals = columns(vertices, "xyz"), columns(vertices, ("nx", "ny", "nz"))
    inside = [[np.tensordot(weights, values[triangles], axes=(0, 1)) for weights in WEIGHTS]
              for values in (positions, normals)]
    positions, normals = np.vstack([positions, *inside[0]]), np.vstack([normals, *inside[1]])
    return positions, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def parts_of(path):
    """The connected parts of the ground truth, thinnest first."""
    vertices, triangles = read_ply(path)
    positions, part = columns(vertices, "xyz"), np.arange(len(vertices))
    while True:
        least = part[triangles].min(axis=1)
        joined = part.copy()
        np.minimum.at(joined, triangles, least[:, None])
        if (joined == part).all():
            break
        part = joined
    return sorted((Part(positions[part == p]) for p in np.unique(part)),
                  key=lambda found: found.thickness_m)


def measure(options, variant, parts):
    """Returns rows of the table, whether all sides of the thicker parts are sound, and the device."""
    mesh, frames = options.work / f"{variant}.ply", options.work / "frames"
    report = reconstruct(options, frames, VOXEL_MM, MAPS[variant], mesh)
    run(options.programs / "evaluate_mesh", mesh, frames / "gt.ply", "--picture",
        options.results / f"{options.stem}_{variant}.png", "--view", "35,20", "--scale-mm", "10",
        "--width", "720", "--height", "448")
    points, rows, sound = points_of(mesh), [], True
    for part in parts:
        for name, side in part.sides().items():
            share, mean_m, worst_m = part.measure(side, *points)
            if part.thickness_m >= MIN_SOUND_THICKNESS_M:
                sound = sound and share >= SOUND_SHARE and abs(mean_m) <= SOUND_OFFSET_M
            rows.append([f"{1000 * part.thickness_m:.0f}", name, variant, f"{share:.0%}",
                         f"{1000 * mean_m:+.2f}", f"{1000 * worst_m:.2f}"])
    return rows, sound, report["device"]


def main():
    parser = make_parser(__doc__, "thin", "models/")
    add = parser.add_argument
    add("--model", default="syn_plates", help="name of a DATA/models/*.ply (default: %(default)s)")
    options = parser.parse_args()
    options.stem = options.model.replace("syn_", "thin_")
    options.work /= options.stem
    options.results.mkdir(parents=True, exist_ok=True)
    frames = render(options, f"models/{options.model}.ply", options.work / "frames", "--frames",
                    FRAMES, "--trajectory", "sphere")
    parts, rows, sound, device = parts_of(frames / "gt.ply"), [], {}, ""
    for variant in MAPS:
        more, sound[variant], device = measure(options, variant, parts)
        rows += more
    rows.sort(key=lambda row: float(row[0]))
    header = ["thickness mm", "side", "map", "fraction covered", "mean offset mm", "largest offset mm"]
    fill_page(options.results / "thin.md", **{options.stem: (
        f"{FRAMES} images, {VOXEL_MM:g} mm voxels.\n\n"
        f"{markdown_table(header, rows)}\n{made_by(device)}")})
    if not sound["directional"]:
        return "the directional map lost a side of a part of 10 mm or more"
    if sound["undirected"]:
        return "the undirected map kept all sides too, so the comparison shows nothing"
    return 0
