#!/usr/bin/env python3
"""01_mesh_of_recording.py RECORDING MESH [VOXEL_SIZE_M]: reconstructs a coloured mesh from a recording."""
import sys

import dtsdf_mapping


def main(path, mesh_path, voxel_size_m="0.02"):
    mapper = dtsdf_mapping.Mapper(**{"map/voxel_size_m": float(voxel_size_m)})
    recording = dtsdf_mapping.Recording(path)
    fused = dtsdf_mapping.fuse(mapper, recording, progress=True)
    print(f"{fused} of {len(recording)} images fused on {mapper.backend}; skipped: {recording.skipped}")
    mesh = mapper.mesh()
    mesh.save(mesh_path)
    print(f"{mesh_path}: {len(mesh.triangles)} triangles")


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
