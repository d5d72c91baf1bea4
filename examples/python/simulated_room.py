"""Simulates depth images of a room with a ball in it, for the other examples.

The room is a box centred at the origin, 5 x 4 x 2.5 m, z up. The ball has a radius of 0.4 m.
"""
import numpy

ROOM_M = numpy.array([5.0, 4.0, 2.5])
BALL_W, BALL_RADIUS_M = numpy.array([0.6, 0.2, -0.4]), 0.4
WIDTH, HEIGHT = 320, 240
K = numpy.array([[260.0, 0.0, 159.5], [0.0, 260.0, 119.5], [0.0, 0.0, 1.0]])


def look_at(eye_W, target_W):
    """The pose T_W_C, a 4 x 4 matrix, of a camera at eye_W facing target_W, with level image rows."""
    z = numpy.subtract(target_W, eye_W, dtype=float)
    z /= numpy.linalg.norm(z)
    x = numpy.cross(z, (0.0, 0.0, 1.0))
    x /= numpy.linalg.norm(x)
    pose = numpy.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, numpy.cross(z, x), z, eye_W
    return pose


def render(T_W_C):
    """Depth image of a camera at T_W_C: (240, 320) float32, in metres along the optical axis."""
    v, u = numpy.mgrid[:HEIGHT, :WIDTH]
    rays_C = numpy.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], numpy.ones_like(u)], -1)
    rays_W = rays_C @ T_W_C[:3, :3].T  # scaled to z_C = 1, so that the factor at a hit is its depth
    eye = T_W_C[:3, 3]
    with numpy.errstate(divide="ignore"):
        depth = ((numpy.sign(rays_W) * ROOM_M / 2 - eye) / rays_W).min(-1)
    a, b = (rays_W ** 2).sum(-1), rays_W @ (eye - BALL_W)
    inside = b ** 2 - a * (((eye - BALL_W) ** 2).sum() - BALL_RADIUS_M ** 2)
    ball = numpy.where(inside > 0, (-b - numpy.sqrt(numpy.maximum(inside, 0))) / a, numpy.inf)
    return numpy.minimum(depth, numpy.where(ball > 0, ball, numpy.inf)).astype(numpy.float32)


def orbit(count):
    """Poses of a camera that circles the ball once, facing it."""
    for angle in numpy.linspace(0.0, 2.0 * numpy.pi, count, endpoint=False):
        eye_W = BALL_W + (1.3 * numpy.cos(angle), 1.3 * numpy.sin(angle), 0.7)
        yield look_at(eye_W, BALL_W)


def distance_to_surface(points_W):
    """True distances from points in the room to the nearest surface, in metres, as an (N,) array."""
    to_walls = (ROOM_M / 2 - numpy.abs(points_W)).min(-1)
    to_ball = numpy.abs(numpy.linalg.norm(points_W - BALL_W, axis=-1) - BALL_RADIUS_M)
    return numpy.minimum(numpy.abs(to_walls), to_ball)
