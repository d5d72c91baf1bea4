#!/usr/bin/env python3
"""Checks that a mesh is the sphere of examples/02_live.cpp: radius 0.5 m, centred at the origin."""
import math
import pathlib
import sys

sys.dont_write_bytecode = True  # keeps the source folder clean
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from proofs.ply import read_ply  # noqa: E402

RADIUS_M = 0.5
VOXEL_M = 0.02


def main(path):
    vertices, triangles = read_ply(path)
    errors = [abs(math.hypot(v["x"], v["y"], v["z"]) - RADIUS_M) for v in vertices]
    mean_m = sum(errors) / max(1, len(errors))
    worst_m = max(errors, default=math.inf)
    print(f"{len(triangles)} triangles, error {1000 * mean_m:.2f} mm, worst {1000 * worst_m:.1f} mm")
    # At least half a triangle per voxel-sized square of the sphere; its poles are not in view.
    least = 2 * math.pi * RADIUS_M ** 2 / VOXEL_M ** 2
    return 0 if len(triangles) > least and mean_m < 0.1 * VOXEL_M and worst_m < VOXEL_M else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
