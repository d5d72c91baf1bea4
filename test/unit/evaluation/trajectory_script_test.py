"""Tests scripts/evaluate_trajectory on trajectories with known errors and on recordings of a room. Uses the
programs in the folder $DTSDF_PROGRAMS."""
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    sys.exit(77)  # skipped

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
import tum_folder  # noqa: E402

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "scripts" / "evaluate_trajectory"
WIDTH, HEIGHT, FOCAL, CX, CY = 160, 120, 130.0, 79.5, 59.5


def write(path, poses):
    path.write_text("# stamp tx ty tz qx qy qz qw\n" +
                    "".join(" ".join(f"{value:.9f}" for value in pose) + "\n" for pose in poses))


def evaluate(*arguments):
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)],
                          capture_output=True, text=True, check=False)


def helix(offset_m=0.0):
    """Yields true poses on a helix and their estimates. The estimates are transformed rigidly and then moved down
    and up by `offset_m` in turn."""
    turn = math.radians(30.0)
    for i in range(40):
        x, y = math.cos(0.3 * i), math.sin(0.3 * i)
        yield [10.0 + i, x, y, 0.05 * i, 0, 0, 0, 1], [
            10.0 + i, math.cos(turn) * x - math.sin(turn) * y + 3.0,
            math.sin(turn) * x + math.cos(turn) * y, 0.05 * i + (offset_m if i % 2 else -offset_m),
            0, 0, math.sin(turn / 2), math.cos(turn / 2)]


class EvaluateTrajectory(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.truth = pathlib.Path(self.folder.name) / "truth.txt"
        self.estimate = pathlib.Path(self.folder.name) / "estimate.txt"

    def figures(self, offset_m):
        write(self.truth, (true for true, _ in helix()))
        write(self.estimate, (found for _, found in helix(offset_m)))
        result = evaluate(self.truth, self.estimate)
        self.assertEqual(result.returncode, 0, result.stderr)
        return {line.split()[0]: line.split()[1] for line in result.stdout.splitlines()}

    def test_a_rigid_motion_is_no_error(self):
        figures = self.figures(0.0)
        self.assertEqual(figures["poses"], "40")
        self.assertLess(float(figures["ate_rmse_m"]), 1e-5)
        self.assertLess(float(figures["rotation_median_deg"]), 1e-3)

    def test_errors_are_measured(self):
        figures = self.figures(0.02)
        self.assertAlmostEqual(float(figures["ate_rmse_m"]), 0.02, delta=3e-4)
        self.assertAlmostEqual(float(figures["ate_mean_m"]), 0.02, delta=3e-4)
        # The error in height changes by 0.04 m between images.
        self.assertAlmostEqual(float(figures["rpe_image_m"]), 0.04, delta=1e-5)
        self.assertAlmostEqual(float(figures["rpe_image_deg"]), 0.0, delta=1e-3)
        self.assertLess(float(figures["rpe_second_m"]), 1e-5)  # poses 30 images apart have the same offset

    def test_invalid_files_are_reported(self):
        write(self.truth, (true for true, _ in helix()))
        self.estimate.write_text("10 1 2 3\n")
        self.assertIn("estimate.txt: expected", evaluate(self.truth, self.estimate).stderr)
        write(self.estimate, [[99.0, 0, 0, 0, 0, 0, 0, 1]])
        self.assertIn("only 0 poses", evaluate(self.truth, self.estimate).stderr)


def pose_of(step):
    """Pose of an image. The camera moves by 25 mm and turns by one degree per image."""
    turn = math.radians(step)
    return np.array([[math.cos(turn), 0, math.sin(turn), 0.02 * step], [0, 1, 0, 0.01 * step],
                     [-math.sin(turn), 0, math.cos(turn), 0.01 * step], [0, 0, 0, 1]])


def render(pose):
    """Renders a depth image in metres of a 3 x 2.4 x 4 m room with three balls."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - CX) / FOCAL, (v - CY) / FOCAL, np.ones_like(u)], axis=-1) @ pose[:3, :3].T
    eye = pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.min((np.sign(rays) * [1.5, 1.2, 2.0] - eye) / rays, axis=-1)
        for x, y, z, radius in ((-0.4, 0.5, 1.3, 0.4), (0.5, -0.3, 1.2, 0.3), (0.3, 0.8, 1.6, 0.5)):
            way = [x, y, z] - eye
            along, length = rays @ way, np.sum(rays * rays, axis=-1)
            near = (along - np.sqrt(along ** 2 - length * (way @ way - radius ** 2))) / length
            depth = np.fmin(depth, near)
    return depth


def record(folder, poses, noise):
    random, images = np.random.default_rng(1), []
    for i, pose in enumerate(poses):
        depth = render(pose)
        depth += noise * depth ** 2 * random.standard_normal(depth.shape)
        turn = math.atan2(pose[0, 2], pose[0, 0])
        images.append((f"{100 + i / 30:.6f}",
                       tum_folder.png([row.tobytes() for row in np.round(5000.0 * depth).astype(">u2")]),
                       (*pose[:3, 3], 0, math.sin(turn / 2), 0, math.cos(turn / 2))))
    tum_folder.write(folder, images)


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def rows(self, poses, noise=0.0):
        folder = pathlib.Path(self.folder.name) / f"room_{noise}"
        record(folder, poses, noise)
        result = evaluate(folder, "--programs", os.environ["DTSDF_PROGRAMS"], "--backend", "cpu",
                          "--work", folder.parent / "work", "--voxel-mm", 40,
                          f"--options=--intrinsics={FOCAL},{FOCAL},{CX},{CY}")
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = result.stdout.splitlines()
        return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines
                if line.startswith("| room")], [line for line in lines if line.startswith("  lost")]

    def test_a_recording_is_tracked_and_refined(self):
        for noise, most_cm in ((0.0, 0.2), (0.0015, 0.6)):
            (track, refine), lost = self.rows([pose_of(i) for i in range(8)], noise)
            self.assertEqual(track[1:3], ["track", "8 of 8"])
            self.assertEqual(refine[1:3], ["refine", "8 of 8"])
            self.assertLess(float(track[3]), most_cm)
            self.assertLess(float(refine[3]), most_cm)
            self.assertEqual(lost, [])

    def test_tracking_is_lost_after_a_jump(self):
        poses = [pose_of(i) for i in range(6)]
        poses += [pose_of(i + 80) for i in range(3)]
        (track, _), lost = self.rows(poses)
        self.assertEqual(track[1:3], ["track", "6 of 9"])
        self.assertRegex(lost[0], r"lost from image 6 \(0.2 s\) for 3: .*; moved by .* and 75.0 degrees")


if __name__ == "__main__":
    unittest.main()
