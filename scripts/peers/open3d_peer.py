#!/usr/bin/env python3
"""Runs Open3D (pip install open3d) on the depth images of a TUM folder, for scripts/compare:

open3d_peer.py fuse FOLDER VOXEL_M THREADS FIRST:LAST:STEP MESH.ply [MAX_DEPTH_M]

Fuses the images with VoxelBlockGrid, and prints the line that scripts/compare reads. THREADS 0 means the GPU.
"""
import json
import os
import pathlib
import re
import sys
import time

if sys.argv[4] != "0":
    os.environ["OMP_NUM_THREADS"] = sys.argv[4]

import numpy as np  # noqa: E402
import open3d as o3d  # noqa: E402

core, UNITS, TRUNCATION_VOXELS = o3d.core, 5000.0, 4.0


def read_folder(folder, frames="::"):
    """Intrinsics, and (stamp, file, pose) of each image that has a pose."""
    folder = pathlib.Path(folder)
    camera = re.search(r"camera_matrix:[^\]]*?data: *\[([^\]]*)\]", (folder / "camera_info.yaml").read_text())
    first, last, step = (int(word) if word else None for word in frames.split(":"))
    poses = np.loadtxt(folder / "groundtruth.txt")
    images = []
    for stamp, name in [line.split() for line in (folder / "depth.txt").read_text().splitlines()
                        if line.strip() and line[0] != "#"]:
        row = poses[np.argmin(np.abs(poses[:, 0] - float(stamp)))]
        pose = np.eye(4)
        pose[:3, :3] = o3d.geometry.get_rotation_matrix_from_quaternion(row[[7, 4, 5, 6]])
        pose[:3, 3] = row[1:4]
        if abs(row[0] - float(stamp)) <= 0.02:
            images.append((stamp, str(folder / name), pose))
    last = None if last is None else last + 1
    return np.array(camera[1].split(","), float).reshape(3, 3), images[first:last:step]


def fuse(folder, voxel_m, threads, frames, mesh_path, max_depth_m="10"):
    device = core.Device("CPU:0" if threads != "0" else "CUDA:0")
    matrix, images = read_folder(folder, frames)
    camera = core.Tensor(matrix)
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (core.float32, core.float32), ((1,), (1,)),
                                         float(voxel_m), 16, 2000, device)
    settings = UNITS, float(max_depth_m), TRUNCATION_VOXELS
    times = []
    for _, path, pose in images:
        depth = o3d.t.io.read_image(path)
        start = time.perf_counter()
        depth, extrinsic = depth.to(device), core.Tensor(np.linalg.inv(pose))
        blocks = grid.compute_unique_block_coordinates(depth, camera, extrinsic, *settings)
        grid.integrate(blocks, depth, camera, extrinsic, *settings)
        if threads == "0":
            core.cuda.synchronize()
        times.append(1e3 * (time.perf_counter() - start))
    memory = grid.hashmap().size() * 16 ** 3 * 8 / 2 ** 20  # blocks in use; Open3D reserves more
    start = time.perf_counter()
    mesh = grid.extract_triangle_mesh(weight_threshold=2.0)
    mesh_ms = 1e3 * (time.perf_counter() - start)
    o3d.t.io.write_triangle_mesh(mesh_path, mesh.cpu())
    print(json.dumps({"version": o3d.__version__, "fuse_ms": float(np.median(times)),
                      "whole_mesh_ms": mesh_ms, "memory_mib": memory}))


if __name__ == "__main__":
    fuse(*sys.argv[2:])
