"""Compares meshes of real recordings with images that were not fused.

Fuses every second image of each recording, at its own poses and at refined poses. Compares the mesh with
the depth images in between, after aligning each image with the mesh. `reconstruct` refines the poses with
the directional map; the other maps use the same refined poses. Pictures show the meshes from the poses of two
images. For recordings without a licence, results are only printed.

--voxblox PROGRAM also measures voxblox on the same images, with its "fast" method and carving. PROGRAM is called
as DIR VOXEL_M METHOD CARVE THREADS MESH.ply FIRST:LAST:STEP.
"""
import json
import os
import pathlib
import shutil

from .common import (MAPS, fill_page, made_by, make_parser, markdown_table, number,
                     reconstruct, run)

# {name: (voxel size in mm, indices of the images at whose poses pictures are rendered)}.
RECORDINGS = {"redkitchen": (20, [31, 101]), "cabinet": (20, [9, 29]), "box": (5, [1, 25]),
              "phone_lidar": (30, [])}
UNPUBLISHED = {"phone_lidar"}  # without a licence
POSES = ["given", "refined"]
REGISTRATION_STEPS = 6

SHARES = {"within 1 %": "share_within_1_percent", "2 %": "share_within_2_percent",
          "5 %": "share_within_5_percent"}
GROSS = {"in front > 5 %": "share_in_front_5_percent", "behind > 5 %": "share_behind_5_percent"}
COLUMNS = [*SHARES, "p95 mm", *GROSS, "covered %", "border edges", "small holes"]


def at_poses(folder, trajectory, to):
    """Creates a folder with links to the files of a TUM folder, but with other poses."""
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    for path in folder.iterdir():
        (to / path.name).symlink_to(path.resolve())
    (to / "groundtruth.txt").unlink()
    shutil.copy(trajectory, to / "groundtruth.txt")
    return to


def fuse(title, folder, voxel_mm, poses, mesh, options):
    """Extracts the mesh of a map fused at the recording's or the refined poses. Returns the device, if known."""
    mesh.unlink(missing_ok=True)
    trajectory = options.work / f"{folder.name}_poses.txt"
    if title == "voxblox":
        if poses == "refined":
            folder = at_poses(folder, trajectory, options.work / f"{folder.name}_refined")
        run(options.voxblox, folder, voxel_mm / 1000, "fast", 1, len(os.sched_getaffinity(0)), mesh,
            f"0:{10**9}:2")
        return None
    more, mode = [], "tf"
    if poses == "refined":
        more = ["--poses", trajectory]
        if title == "directional":
            more, mode = ["--trajectory", trajectory], "refine"
    return reconstruct(options, folder, voxel_mm, [*MAPS[title], "colour/enabled=never"], mesh,
                       "--frames", "::2", *more, poses=mode)["device"]


def measure(mesh, folder, options):
    """Returns the cells of a row: accuracies as percentages of the measured pixels that the mesh covers, and
    gross errors as percentages of all measured pixels."""
    depth = json.loads(run(options.programs / "evaluate_depth", mesh, folder, "--first", 1,
                           "--step", 2, "--stride", options.stride, "--register",
                           REGISTRATION_STEPS))["registered"]
    topology = json.loads(run(options.programs / "evaluate_mesh", mesh, "--topology"))
    covered = depth["covered_share"]
    return [*(f"{100 * depth[key] / covered:.1f}" for key in SHARES.values()),
            number(depth["p95_mm"]), *(f"{100 * depth[key]:.2f}" for key in GROSS.values()),
            f"{100 * covered:.1f}", topology["border_edges"], topology["small_holes"]]


def measure_recording(name, options):
    """Returns rows of metrics, rows of pictures (one per image and kind of poses), and the device."""
    voxel_mm, images = RECORDINGS[name]
    folder = options.data / "sequences" / name
    folder_of_pictures = pathlib.Path(options.page).parent / "pictures"
    rows, pictures, device = [], [], ""
    for poses in POSES:
        drawn = {image: [f"{name}, image {image}, {poses}"] for image in images}
        for title in options.titles:
            mesh = options.work / f"{name}_{title}_{poses}.ply"
            device = fuse(title, folder, voxel_mm, poses, mesh, options) or device
            rows.append([f"{name}, {voxel_mm:g}", poses, title, *measure(mesh, folder, options)])
            print("|", " | ".join(map(str, rows[-1])), "|", flush=True)
            for image in images if options.page != "-" else []:
                folder_of_pictures.mkdir(parents=True, exist_ok=True)
                picture = folder_of_pictures / f"{name}_{image}_{title}_{poses}.png"
                run(options.programs / "render_mesh", mesh, picture, "--plain", "--views", folder,
                    "--image", image)
                drawn[image].append(f"![](pictures/{picture.name})")
        pictures += drawn.values()
    return rows, pictures, device


def read_options():
    parser = make_parser(__doc__, "recordings", "sequences/")
    add = parser.add_argument
    add("--stride", default=1, help="use every STRIDE-th pixel of each row and column (default: %(default)s)")
    add("--voxblox", metavar="PROGRAM", help="also measure the meshes of this program")
    add("--page", help="page to fill (default: RESULTS/recordings.md); '-' for none")
    options = parser.parse_args()
    options.page = options.page or str(options.results / "recordings.md")
    options.titles = list(MAPS) + (["voxblox"] if options.voxblox else [])
    return options


def main():
    options = read_options()
    options.work.mkdir(parents=True, exist_ok=True)
    published, pictures, device = [], [], ""
    for name in RECORDINGS:
        rows, drawn, device = measure_recording(name, options)
        if name not in UNPUBLISHED:
            published += rows
            pictures += drawn
    if options.page == "-" or not published:
        return 0
    table = markdown_table(["recording, voxel mm", "poses", "map", *COLUMNS], published)
    shown = markdown_table(["", *options.titles], pictures)
    fill_page(pathlib.Path(options.page), recordings=f"{table}\n{made_by(device)}\n{shown}")
    return 0
