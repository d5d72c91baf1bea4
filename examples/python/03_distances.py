#!/usr/bin/env python3
"""Checks which of two straight paths through a room are free for a robot with a radius of 0.3 m."""
import sys

import numpy

import dtsdf_mapping
import simulated_room as room

ROBOT_RADIUS_M = 0.3


def main():
    mapper = dtsdf_mapping.Mapper(**{"map/voxel_size_m": 0.04, "space/enabled": True})
    for T_W_C in room.orbit(60):
        mapper.integrate(room.render(T_W_C), room.K, T_W_C)
    mapper.space.update()  # computes distances from all images so far

    steps = numpy.linspace(0.0, 1.0, 50)[:, None]
    height = room.BALL_W[2]
    for name, start, end in (("through the ball", (-0.3, 0.2, height), (1.5, 0.2, height)),
                             ("around it", (-0.3, -0.7, height), (1.5, -0.7, height))):
        way_W = (1.0 - steps) * start + steps * numpy.array(end)
        known, distance_m, _ = mapper.space.query(way_W)
        passes = known.all() and distance_m.min() > ROBOT_RADIUS_M
        nearest = f"{distance_m[known].min():.2f} m" if known.any() else "unknown"
        print(f"{name}: {'free' if passes else 'not free'}, {known.mean():.0%} known, nearest {nearest}")


if __name__ == "__main__":
    print(__doc__) if "--help" in sys.argv else main()
