#!/usr/bin/env python3
"""check_docs.py finds what is wrong, and nothing else."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_docs  # noqa: E402

SOUND = {
    "README.md": "[method](docs/method.md#the-numbers) and `src/kernels/fusion/fusion_rules.h`\n",
    "docs/method.md": "# The numbers\n\n| stage | takes |\n|---|---|\n| make surfels | depth |\n\n"
                      "| `rules/fusion/sample_reach` | 1/4 | reach |\n",
    "docs/ros.md": "| `backend` | `map/voxel_size_m` |\n",
    "config/default.yaml": "backend: auto\n\nmap:\n  voxel_size_m: 0.02  # edge\n",
    "src/backend/profile.cpp": 'case Stage::kMakeSurfels: return "make_surfels";\n',
    "src/backend/rules.h": '{\n  const std::string section = "rules/fusion/";\n'
                           '  visit(section + "sample_reach", rules.sample_reach);\n}\n',
    "src/kernels/fusion/fusion_rules.h":
        "struct FusionRules {\n  /// Why.\n  float sample_reach = 1.0f / 4.0f;  ///< In voxels.\n};\n",
}


class CheckDocs(unittest.TestCase):
    def problems(self, **changes):
        """What is found after files (named without their ending) got more text."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in SOUND.items():
                path = root / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(changes.get(path.stem, "{}").replace("{}", text))
            return list(check_docs.problems(root))

    def expect_one(self, part, **changes):
        found = self.problems(**changes)
        self.assertEqual(len(found), 1, found)
        self.assertIn(part, found[0])

    def test_accepts_what_is_sound(self):
        self.assertEqual(self.problems(), [])

    def test_finds_broken_links(self):
        self.expect_one("no such file", README="{}[x](docs/gone.md)\n")
        self.expect_one("no such heading", README="{}[x](docs/method.md#gone)\n")

    def test_finds_files_that_are_gone(self):
        self.expect_one("names fusion/gone.h", README="{}`fusion/gone.h`\n")
        self.expect_one("names scripts/gone", README="{}Run scripts/gone now.\n")

    def test_finds_kernels_that_are_gone(self):
        self.expect_one("names foldKernel", ros="{}`foldKernel`\n")

    def test_finds_pages_that_are_gone(self):
        self.expect_one("names docs/gone.md", profile="{}// docs/gone.md\n")

    def test_finds_numbers_that_differ(self):
        self.expect_one("is missing", method="# The numbers\n\n| stage | x |\n|---|---|\n"
                                             "| make surfels | y |\n\n")
        self.expect_one("is not in the code", method="{}| `rules/fusion/gone` | 1 | x |\n")
        self.expect_one("is 0.25, not 2", method="{}| `rules/fusion/sample_reach` | 2 | x |\n")

    def test_finds_numbers_that_nobody_can_set(self):
        self.expect_one("sample_reach is not visited",
                        rules='{\n  const std::string section = "rules/fusion/";\n}\n')

    def test_finds_stages_that_differ(self):
        self.expect_one("'fold' is missing", profile='{}case Stage::kFold: return "fold";\n')

    def test_finds_settings_that_are_missing(self):
        self.expect_one("map/directional", default="{}  directional: true\n")


if __name__ == "__main__":
    unittest.main()
