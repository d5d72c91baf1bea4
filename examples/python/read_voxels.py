#!/usr/bin/env python3
"""read_voxels.py OUT.npz: the voxels of a map as arrays, for training or for another program."""
import sys

import numpy

import dtsdf_mapping
import simulated_room as room


def main(path):
    mapper = dtsdf_mapping.Mapper(**{"map/voxel_size_m": 0.05})
    for T_W_C in room.orbit(30):
        mapper.integrate(room.render(T_W_C), room.K, T_W_C)
    blocks = mapper.blocks()
    distance_m = blocks.distance_m
    array, z, y, x = numpy.nonzero(blocks.weight)
    key = blocks.keys[blocks.block_of[array]]
    position_W = (8 * key + numpy.stack([x, y, z], -1)) * blocks.voxel_size_m
    numpy.savez_compressed(path, position_W=position_W.astype(numpy.float32),
                           distance_m=distance_m[array, z, y, x], direction=blocks.direction[array])
    print(f"{path}: {len(array)} voxels of {len(blocks.keys)} blocks")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
