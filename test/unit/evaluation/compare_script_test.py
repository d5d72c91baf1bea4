"""Tests scripts/compare on a small model, with a fake and a missing peer (a program to compare with). Uses the
programs in the folder $DTSDF_PROGRAMS."""
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "scripts" / "compare"
CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
TRIANGLES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
             (0, 6, 4), (1, 5, 7), (1, 7, 3)]
# A peer that returns the ground truth.
PEER = """#!/bin/sh
cp "$(dirname "$1")/asian_dragon_8/gt.ply" "$5"
echo '{"version": "1", "fuse_ms": 2.5, "whole_mesh_ms": 40, "memory_mib": 7}'
"""


class Compare(unittest.TestCase):
    def test_tables_list_mappers_and_name_missing_ones(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "models").mkdir()
            (folder / "models" / "asian_dragon.ply").write_bytes(
                b"ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
                b"property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n" +
                b"".join(struct.pack("<3f", *corner) for corner in CORNERS) +
                b"".join(struct.pack("<B3i", 3, *triangle) for triangle in TRIANGLES))
            peer = folder / "peer"
            peer.write_text(PEER)
            peer.chmod(0o755)
            result = subprocess.run(
                [sys.executable, str(SCRIPT), "--data", name, "--work", str(folder / "work"), "--results", name,
                 "--programs", os.environ["DTSDF_PROGRAMS"], "--cells", "asian_dragon:20", "--rounds", "1", "--images",
                 "8", "--samples", "20000", "--threads", "1", "--peer", f"truth={peer}", "--peer", "nobody=/no/such/program"],
                capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 0, result.stderr)
            page = (folder / "compare.md").read_text(encoding="utf-8")
            self.assertIn("Not measured: nobody, 1 thread (asian_dragon, 20 mm).", page)
            self.assertNotIn(name, page)
            rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines()
                    if line.startswith(("| asian_dragon, 20 mm", "| |"))]
            mappers = ["**directional**", "**undirected**", "truth"]
            self.assertEqual([row[1] for row in rows], mappers + mappers)
            self.assertEqual(rows[2][2:], ["2.50", "–", "40.0", "7.00", "0.00", "0.00", "–"])
            self.assertEqual(rows[5][2:], ["0.00", "0.00", "100.0", "0.00", "100.0", "100.0"])
            self.assertLess(float(rows[0][2]), float(rows[0][3]))  # without and with meshing
            self.assertLess(float(rows[0][6]), 2.0)


if __name__ == "__main__":
    unittest.main()
