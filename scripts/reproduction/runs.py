"""The runs behind the tables: rendering, reconstruction, evaluation; each is done once."""
import dataclasses
import hashlib
import json
import pathlib
import subprocess
import sys
import threading

MODES = {
    "undirected-vp": ("false", "voxel_projection"),
    "undirected-rc": ("false", "ray_casting"),
    "undirected-rcn": ("false", "normal_ray_casting"),
    "directional-vp": ("true", "voxel_projection"),
    "directional-rc": ("true", "ray_casting"),
    "directional-rcn": ("true", "normal_ray_casting"),
}

# The scene whose recording is given, not rendered: it stands in for the paper's Table II.
HOUSE = "house_noisy"


@dataclasses.dataclass(frozen=True)
class Cell:
    """One reconstruction: what of, how fine and how."""
    model: str
    voxel_mm: float
    mode: str

    def name(self):
        return f"{self.model}_{self.voxel_mm:g}mm_{self.mode}"


class StepFailed(Exception):
    """A program gave an error, which it has printed."""


def find_programs(root):
    """The folder of this checkout's programs, with or without ROS; --programs overrides it."""
    for folder in ("build/devel/lib/dtsdf_mapping", "build/bin"):
        if (root / folder / "reconstruct").exists():
            return str(root / folder)
    return str(root / "build/bin")


def hash_of(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        for chunk in iter(lambda: file.read(1 << 20), b""):
            digest.update(chunk)
    return digest.hexdigest()


class Steps:
    """Runs programs; skips those whose command, program and inputs are unchanged."""

    def __init__(self, options):
        self.options = options
        self._hashes = {}
        self._lock = threading.Lock()  # guards _hashes

    def _program(self, name):
        return pathlib.Path(self.options.programs).resolve() / name

    def _hash(self, path):
        path = pathlib.Path(path)
        stat = path.stat()
        key = (str(path), stat.st_mtime_ns, stat.st_size)
        with self._lock:
            if key not in self._hashes:
                self._hashes[key] = hash_of(path)
            return self._hashes[key]

    def _step(self, record_path, command, inputs, outputs, quiet=False):
        """Runs a command unless the record says that this very step gave these outputs."""
        command = [str(part) for part in command]
        record = {"command": command[1:],
                  "program": self._hash(command[0]),
                  "inputs": {str(path): self._hash(path) for path in inputs}}
        if all(path.exists() for path in outputs) and record_path.exists():
            if json.loads(record_path.read_text()) == record:
                return
        record_path.parent.mkdir(parents=True, exist_ok=True)
        record_path.unlink(missing_ok=True)  # half a step must not pass for a whole one
        # Several at a time would write their progress over one another's.
        silent = quiet or self.options.jobs > 1
        done = subprocess.run(command, stdout=subprocess.DEVNULL if silent else sys.stderr,
                              check=False)
        if done.returncode != 0:
            raise StepFailed(f"{' '.join(command)}: exit code {done.returncode}")
        record_path.write_text(json.dumps(record, indent=2) + "\n")


class Runner(Steps):
    """Runs the steps of cells."""

    def __init__(self, options):
        super().__init__(options)
        self.work = pathlib.Path(options.work) / options.setup_name()

    def views(self, cell):
        """The TUM folder of a cell's frames."""
        if cell.model == HOUSE:
            return pathlib.Path(self.options.data) / "sequences" / HOUSE
        return self.work / "orbits" / cell.model

    def ground_truth(self, cell):
        if cell.model == HOUSE:
            return pathlib.Path(self.options.data) / "scenes" / "house.ply"
        return self.views(cell) / "gt.ply"

    def folder(self, cell):
        return self.work / "cells" / cell.name()

    def is_timed(self, cell):
        """Whether the cell's updates are timed: run by itself, meshed every few frames."""
        return cell.model in self.options.timed

    def render(self, cell):
        if cell.model == HOUSE:
            return
        options, folder = self.options, self.views(cell)
        model = pathlib.Path(options.data) / "models" / f"{cell.model}.ply"
        command = [self._program("render_orbit"), model, folder, "--frames", options.frames,
                   "--trajectory", options.trajectory, "--noise", options.noise]
        self._step(folder / "render.json", command, [model], [folder / "groundtruth.txt"])

    def reconstruct(self, cell):
        options, folder = self.options, self.folder(cell)
        directional, fusion = MODES[cell.mode]
        command = [self._program("reconstruct"), "--tum", self.views(cell),
                   "--backend", options.backend,
                   "--mesh", folder / "mesh.ply", "--report", folder / "report.json"]
        if self.is_timed(cell):
            command += ["--mesh-every", options.mesh_every]
        if options.config:
            command += ["--config", options.config]
        settings = [f"map/voxel_size_m={cell.voxel_mm / 1000:g}", f"map/directional={directional}",
                    f"fusion/mode={fusion}"] + options.set
        for setting in settings:
            command += ["--set", setting]
        inputs = [self.views(cell) / "groundtruth.txt", self.views(cell) / "depth.txt"]
        if cell.model != HOUSE:
            inputs.append(self.ground_truth(cell))
        if options.config:
            inputs.append(pathlib.Path(options.config))
        self._step(folder / "reconstruct.json", command, inputs,
                   [folder / "mesh.ply", folder / "report.json"])

    def evaluate(self, cell):
        folder = self.folder(cell)
        picture = folder / "error.png"
        view = ["--up", "z", "--view", "35,40"] if cell.model == HOUSE else ["--view", "25,15"]
        command = [self._program("evaluate_mesh"), folder / "mesh.ply", self.ground_truth(cell),
                   "--views", self.views(cell), "--threshold", "0.005,0.01,0.025",
                   "--samples", self.options.samples, "--json", folder / "evaluation.json",
                   "--heatmap", folder / "error.ply", "--picture", picture,
                   # One scale for all modes of a voxel size, so that the pictures compare.
                   "--scale-mm", f"{cell.voxel_mm / 5:g}", "--width", 720, "--height", 560] + view
        self._step(folder / "evaluate.json", command,
                   [folder / "mesh.ply", self.ground_truth(cell),
                    self.views(cell) / "groundtruth.txt"],
                   [folder / "evaluation.json", picture], quiet=True)

    def result(self, cell):
        """{"report": ..., "evaluation": ...} of a finished cell, or None."""
        folder = self.folder(cell)
        try:
            return {name: json.loads((folder / f"{name}.json").read_text())
                    for name in ("report", "evaluation")}
        except FileNotFoundError:
            return None
