"""Compares the free cells and distances of a map with the ground truth of an analytic scene, at several cell
sizes.

Fills space.md. Exits with 0 only if all sampled free cells were observed and none is occupied, and distances at
cell centres have an RMSE of at most half a cell and no error above one and a half cells.
"""
import json

from .common import fill_page, made_by, make_parser, markdown_table, number, run

# {cell size in mm: (voxel size in m, voxels along the edge of a cell, maximum distance in m)}.
CELLS = {50: (0.025, 2, 2.0), 100: (0.025, 4, 2.0), 200: (0.025, 8, 2.0), 20: (0.02, 1, 0.3)}
HEADER = ["cell mm", "range m", "RMSE", "mean", "least to greatest",
          "off by more than 1.5", "RMSE anywhere", "free, but occupied", "free, but not observed",
          "found, of observed free cells"]


def measure(options, cell_mm):
    voxel_m, cell_voxels, reach_m = CELLS[cell_mm]
    # With min_support 1, a surface visible in a single image counts, as in the ground truth.
    return json.loads(run(
        options.programs / "evaluate_space", "--samples", options.samples, "--set",
        f"backend={options.backend}", f"map/voxel_size_m={voxel_m}",
        f"space/cell_voxels={cell_voxels}", f"space/max_distance_m={reach_m}",
        "mesh/min_support=1"))


def row_of(cell_mm, figures):
    middles, points = figures["at_middles"], figures["at_points"]
    share = figures["found_free"] / max(1, figures["truly_free"])
    return [cell_mm, f"{CELLS[cell_mm][2]:g}", number(middles["rmse_mm"] / cell_mm),
            number(middles["mean_mm"] / cell_mm),
            f"{middles['least_mm'] / cell_mm:.2f} to {middles['greatest_mm'] / cell_mm:.2f}",
            f"{middles['far_off']} of {middles['count']}", number(points["rmse_mm"] / cell_mm),
            f"{figures['taken']} of {figures['looked_at']}",
            f"{figures['unseen']} of {figures['looked_at']}", f"{share:.0%}"]


def is_sound(cell_mm, figures):
    middles = figures["at_middles"]
    return (middles["rmse_mm"] <= 0.5 * cell_mm and middles["far_off"] == 0 and
            figures["taken"] == 0 and figures["unseen"] == 0)


def main():
    parser = make_parser(__doc__)
    parser.add_argument("--samples", type=int, default=20000,
                        help="number of cells to sample for each measurement (default: %(default)s)")
    options = parser.parse_args()
    rows, is_all_sound = [], True
    for cell_mm in CELLS:
        figures = measure(options, cell_mm)
        rows.append(row_of(cell_mm, figures))
        is_all_sound = is_all_sound and is_sound(cell_mm, figures)
    fill_page(options.results / "space.md",
              figures=f"{markdown_table(HEADER, rows)}\n{made_by(options.backend)}")
    return 0 if is_all_sound else "a measurement exceeds its limit"
