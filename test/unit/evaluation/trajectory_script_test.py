"""scripts/evaluate_trajectory against errors that are known."""
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "scripts" / "evaluate_trajectory"


def write(path, poses):
    path.write_text("# stamp tx ty tz qx qy qz qw\n" +
                    "".join(" ".join(f"{value:.9f}" for value in pose) + "\n" for pose in poses))


def evaluate(truth, estimate):
    return subprocess.run([sys.executable, str(SCRIPT), str(truth), str(estimate)],
                          capture_output=True, text=True, check=False)


def helix(offset_m=0.0):
    """A moved and turned helix; every second pose lies `offset_m` above it, the others below."""
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
        self.assertAlmostEqual(float(self.figures(0.02)["ate_rmse_m"]), 0.02, delta=3e-4)

    def test_wrong_files_are_named(self):
        write(self.truth, (true for true, _ in helix()))
        self.estimate.write_text("10 1 2 3\n")
        self.assertIn("estimate.txt:1: expected", evaluate(self.truth, self.estimate).stderr)
        write(self.estimate, [[99.0, 0, 0, 0, 0, 0, 0, 1]])
        self.assertIn("only 0 poses", evaluate(self.truth, self.estimate).stderr)


if __name__ == "__main__":
    unittest.main()
