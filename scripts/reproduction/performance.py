"""The page on speed and memory from the reports of `benchmark`."""
import dataclasses

from .tables import markdown_table

MIB = 2 ** 20
HOST_STAGES = ("copy", "admit", "hand_out")
FLIGHT_SPEED_M = 2  # from frame to frame

# What is aimed at and what must be met, median ms from upload to updated mesh, on one H200.
TARGETS_MS = {
    ("asian_dragon", 5): (0.50, 1.0), ("asian_dragon", 10): (0.25, 0.6),
    ("asian_dragon", 20): (0.20, 0.32), ("redkitchen", 10): (1.0, 4.0),
    ("redkitchen", 20): (0.5, 1.2), ("house_noisy", 10): (1.5, 5.0),
    ("house_noisy", 20): (0.6, 2.0),
}
# The same with others' code: (authors of the paper, nvblox).
OTHERS_MS = {
    ("asian_dragon", 5): (3.84, 5.7), ("asian_dragon", 10): (2.69, 0.99),
    ("asian_dragon", 20): (2.52, 0.32), ("redkitchen", 10): (None, 6.5),
    ("redkitchen", 20): (None, 1.2), ("house_noisy", 10): (None, 26),
    ("house_noisy", 20): (None, 4.6),
}
# Map and mesh on the GPU in MiB: (aim, no more than, nvblox).
TARGETS_MIB = {5: (60, 110, 162), 10: (20, 39, 26), 20: (6, 19, 5)}
# Two CPU threads, integration and mesh: (aim, must), ms.
TARGETS_CPU_MS = {("redkitchen", 20): (25, 46), ("redkitchen", 10): (60, 115)}


@dataclasses.dataclass(frozen=True)
class Cell:
    """One run: on what, what of and how fine."""
    backend: str
    threads: int
    recording: str
    voxel_mm: float

    def name(self):
        threads = f"_{self.threads}_threads" if self.backend == "cpu" else ""
        return f"{self.backend}{threads}_{self.recording}_{self.voxel_mm:g}mm"

    def is_flight(self):
        return self.recording == "flight"


def number(value):
    """Three digits."""
    if value is None:
        return "–"
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def spread(times):
    return " / ".join(f"{times[key]:.3g}" for key in ("median", "p95", "worst"))


def verdict(value, target):
    if not target:
        return "–"
    aim, must = target[0], target[1]
    words = "met" if value <= aim else "must met" if value <= must else "**missed**"
    return f"{aim:g} ({must:g}): {words}"


class Performance:
    """Draws the page of the cells that have a result."""

    def __init__(self, results, gpu):
        self.gpu = gpu
        self.cuda = self._select(results, lambda cell: cell.backend == "cuda")
        self.cpu = self._select(results, lambda cell: cell.backend == "cpu")
        self.flights = {cell: result for cell, result in results.items() if cell.is_flight()}

    @staticmethod
    def _select(results, keep):
        return {cell: result for cell, result in results.items()
                if keep(cell) and not cell.is_flight()}

    def page(self, made):
        parts = [
            "# Time and memory of a frame\n",
            f"{made}\nDirectional along normals, the package's defaults, frames in memory before "
            "they are timed, a mesh update after each. Times are milliseconds. All figures are in "
            "[performance.json](performance.json).\n",
            self._section("On the GPU: from upload to updated mesh", (
                "From the call of integrate() until the changed meshes are made on the device, "
                "with nothing else going on; median / 95th percentile / worst but for the first frame. "
                "Fetch: from there until the host has them. Overlapped: mean per frame where the "
                "fetch runs beside the next frame."), self._totals()),
            self._section("Memory on the GPU", (
                "MiB after the last frame: held by data / taken in slabs and buffers. Process: "
                "what the device lost since the mapper was made, where each buffer takes whole "
                "2 MiB pages. Mesh buffers hold what changed last; the whole mesh is on the host. "
                "The targets are for map and mesh, taken."), self._memory()),
            self._section("Stages on the GPU", (
                "Median ms of a run of its own with CUDA events round each stage (share of the "
                "measured copy bandwidth, of the bus for upload and fetch, that the bytes which "
                "must move come to). copy, admit and hand_out are times of the host."),
                self._stages(self.cuda)),
            self._section("What a stage has to do", (
                "Median KiB that must move, thousands of operations, and the time that the bytes "
                "take at full bandwidth."), self._work(self.cuda)),
            self._section("Kernels", self._kernel_text(), self._kernels()),
            self._flight(),
            self._section("On the CPU", (
                "Integration and incremental mesh; median / 95th percentile / worst but for the "
                "first frame. The targets are for two threads of the development machine."),
                self._cpu_totals()),
            self._section("Stages on the CPU", "Median ms.", self._stages(self.cpu, False))]
        return "\n".join(part for part in parts if part)

    @staticmethod
    def _section(title, text, table):
        return f"## {title}\n\n{text}\n\n{table}" if table else ""

    def _totals(self):
        rows = []
        for cell, result in self.cuda.items():
            key = (cell.recording, cell.voxel_mm)
            others = OTHERS_MS.get(key, (None, None))
            total = result["total_ms"]
            rows.append([cell.recording, f"{cell.voxel_mm:g}", spread(total),
                         verdict(total["median"], TARGETS_MS.get(key)),
                         number(result["fetch_ms"]["median"]), number(result["overlapped_ms"]),
                         number(others[0]), number(others[1]), result["frames"],
                         result["map"]["blocks"], result["map"]["triangles"]])
        header = ["recording", "voxel mm", "total", "target (must)", "fetch", "overlapped",
                  "authors' code", "nvblox", "frames", "blocks", "triangles"]
        return markdown_table(header, rows) if rows else ""

    def _memory(self):
        rows = []
        for cell, result in self.cuda.items():
            memory = result["memory"]

            def both(kind, memory=memory):
                used, reserved = (memory[kind][what] / MIB for what in ("used", "reserved"))
                return f"{used:.1f} / {reserved:.1f}"

            taken = (memory["map"]["reserved"] + memory["mesh"]["reserved"]) / MIB
            target = None
            if cell.recording == "asian_dragon":
                target = TARGETS_MIB.get(cell.voxel_mm)
            rows.append([cell.recording, f"{cell.voxel_mm:g}", both("map"), both("mesh"),
                         f"{taken:.1f}", verdict(taken, target), number(target and target[2]),
                         f"{memory['scratch']['reserved'] / MIB:.1f}",
                         f"{memory['staging']['reserved'] / MIB:.1f}",
                         f"{memory['device'] / MIB:.0f}", f"{memory['whole_mesh'] / MIB:.1f}"])
        header = ["recording", "voxel mm", "map", "mesh", "map and mesh", "aim (no more than)",
                  "nvblox", "scratch", "staging (host)", "process", "whole mesh (host)"]
        return markdown_table(header, rows) if rows else ""

    @staticmethod
    def _stage_names(results):
        names = []
        for result in results.values():
            names += [stage["stage"] for stage in result["stages"] if stage["stage"] not in names]
        return names

    @staticmethod
    def _stage(result, name):
        return next((stage for stage in result["stages"] if stage["stage"] == name), None)

    @staticmethod
    def _columns(results):
        return [f"{cell.recording} {cell.voxel_mm:g} mm" +
                (f", {cell.threads} thr." if cell.backend == "cpu" else "") for cell in results]

    def _stages(self, results, with_share=True):
        rows = []
        for name in self._stage_names(results):
            row = [name]
            for result in results.values():
                stage = self._stage(result, name)
                text = f"{stage['ms']['median']:.3f}" if stage else "–"
                if stage and with_share and stage["bytes"] > 0 and name not in HOST_STAGES:
                    text += f" ({stage['share_of_bandwidth']:.0%})"
                row.append(text)
            rows.append(row)
        return markdown_table(["stage", *self._columns(results)], rows) if rows else ""

    def _work(self, results):
        rows = []
        for name in self._stage_names(results):
            row = [name]
            for result in results.values():
                stage = self._stage(result, name)
                row.append("–" if not stage else f"{stage['bytes'] / 1024:.0f} / "
                           f"{stage['operations'] / 1e3:.0f} / {stage['floor_ms']:.4f}")
            rows.append(row)
        return markdown_table(["stage", *self._columns(results)], rows) if rows else ""

    def _kernel_text(self):
        if not self.gpu:
            return ""
        rates = self.gpu["rates_gb_s"]
        capability = self.gpu["compute_capability"] / 10
        return (f"{self.gpu['name']}, compute capability {capability:.1f}; copies measured at "
                f"{rates['memory']:.0f} GB/s (device memory, read and written), "
                f"{rates['upload']:.0f} and {rates['download']:.0f} GB/s (bus). Blocks of "
                "256 threads. The last column is what these registers and this shared memory come "
                "to on compute capability 7.5 (1024 threads, 64 KiB of shared memory).")

    def _kernels(self):
        if not self.gpu:
            return ""
        rows = [[f"`{kernel['name']}`", kernel["registers"], kernel["shared_bytes"],
                 kernel["local_bytes"], kernel["blocks_per_processor"],
                 f"{kernel['occupancy']:.0%}", f"{kernel['occupancy_on_7_5']:.0%}"]
                for kernel in self.gpu["kernels"]]
        header = ["kernel", "registers", "shared bytes", "local bytes",
                  "blocks per multiprocessor", "occupancy", "on 7.5"]
        return markdown_table(header, rows)

    def _flight(self):
        parts = []
        for cell, result in self.flights.items():
            rows = [[row["gib"], row["frames"], spread(row["total_ms"]), spread(row["fetch_ms"])]
                    for row in result["by_gib"]]
            slowest = [[row["frame"], f"{row['map_gib']:.2f}", number(row["total_ms"]),
                        number(row["call_ms"])] for row in result["slowest"]]
            blocks = result["map"]["blocks"]
            parts.append(
                "## A map that grows\n\n"
                f"A synthetic flight at {cell.voxel_mm:g} mm voxels, {FLIGHT_SPEED_M} m a frame, "
                f"until the map has {result['map']['bytes'] / 2**30:.1f} GiB: {result['frames']} frames, {blocks} "
                f"blocks, {blocks / result['frames']:.0f} new ones a frame. Median / 95th "
                "percentile / worst while the map is in its n-th GiB.\n\n" +
                markdown_table(["map from GiB", "frames", "total", "fetch"], rows) +
                "\nThe slowest frames:\n\n" +
                markdown_table(["frame", "map GiB", "total", "of it in integrate()"], slowest))
        return "\n".join(parts)

    def _cpu_totals(self):
        rows = []
        for cell, result in self.cpu.items():
            target = None
            if cell.threads == 2:
                target = TARGETS_CPU_MS.get((cell.recording, cell.voxel_mm))
            rows.append([cell.recording, f"{cell.voxel_mm:g}", cell.threads,
                         spread(result["total_ms"]), number(result["call_ms"]["median"]),
                         verdict(result["total_ms"]["median"], target), result["frames"]])
        header = ["recording", "voxel mm", "threads", "total", "of it integration",
                  "target (must)", "frames"]
        return markdown_table(header, rows) if rows else ""
