"""An analytic scene: a wall at z = 2 m, viewed from the origin along z."""
import numpy

K = numpy.array([[130.0, 0.0, 79.5], [0.0, 130.0, 59.5], [0.0, 0.0, 1.0]])
T_W_C = numpy.eye(4)
SHAPE = (120, 160)


def wall(distance_m=2.0):
    """A depth image of a wall perpendicular to the optical axis, (120, 160) float32, in metres."""
    return numpy.full(SHAPE, distance_m, numpy.float32)


def map_of_wall(package, frames=3, **settings):
    """A mapper that has fused images of the wall, with voxels of 4 cm."""
    settings = {"map/voxel_size_m": 0.04, "threads": 1, **settings}
    mapper = package.Mapper("cpu", **settings)
    for _ in range(frames):
        mapper.integrate(wall(), K, T_W_C)
    return mapper
