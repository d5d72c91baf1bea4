#!/usr/bin/env python3
"""02_live.py MESH MAP: fuses depth images and poses supplied by your own code, and saves the mesh and the map."""
import sys

import numpy

import dtsdf_mapping
import simulated_room as room


def main(mesh_path, map_path):
    mapper = dtsdf_mapping.Mapper(**{"map/voxel_size_m": 0.04})
    for T_W_C in room.orbit(60):
        result = mapper.integrate(room.render(T_W_C), room.K, T_W_C)
        if not result:
            print("not fused:", result.status, result.message)
    mesh = mapper.mesh()
    error_mm = 1000.0 * room.distance_to_surface(mesh.vertices + mesh.origin_m)
    print(f"{len(mesh.triangles)} triangles, {numpy.sqrt((error_mm ** 2).mean()):.2f} mm off the room "
          "(RMSE)")
    mesh.save(mesh_path)
    mapper.save(map_path)

    resumed = dtsdf_mapping.Mapper.load(map_path)  # can also be done later, in another process
    print(f"the loaded map: {resumed.stats['blocks']} blocks, {resumed.stats['map_bytes'] / 1e6:.1f} MB")


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
