"""The page on speed and memory from the reports of `benchmark`."""
import dataclasses

from .tables import markdown_table

MIB = 2 ** 20
FLIGHT_SPEED_M = 2  # from frame to frame


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
            "they are timed, a mesh update after each. Times are milliseconds.\n",
            self._section("On the GPU: from upload to updated mesh", (
                "From the call of integrate() until the changed meshes are made on the device, "
                "with nothing else going on; median / 95th percentile / worst but for the first frame. "
                "Fetch: from there until the host has them. Overlapped: mean per frame where the "
                "fetch runs beside the next frame."),
                self._totals()),
            self._section("Memory on the GPU", (
                "MiB after the last frame: held by data / taken in slabs and buffers. Process: "
                "what the device lost since the mapper was made, where each buffer takes whole "
                "2 MiB pages. Mesh buffers hold what changed last; the whole mesh is on the host."),
                self._memory()),
            self._section("Stages on the GPU", (
                "Median ms of a run of its own with CUDA events round each stage. copy, admit and "
                "hand_out are times of the host."),
                self._stages(self.cuda)),
            self._rates(),
            self._flight(),
            self._section("On the CPU", (
                "Integration and incremental mesh; median / 95th percentile / worst but for the "
                "first frame."), self._cpu_totals()),
            self._section("Stages on the CPU", "Median ms.", self._stages(self.cpu))]
        return "\n".join(part for part in parts if part)

    @staticmethod
    def _section(title, text, table):
        return f"## {title}\n\n{text}\n\n{table}" if table else ""

    def _totals(self):
        rows = []
        for cell, result in self.cuda.items():
            total = result["total_ms"]
            rows.append([cell.recording, f"{cell.voxel_mm:g}", spread(total),
                         number(result["fetch_ms"]["median"]), number(result["overlapped_ms"]),
                         result["frames"], result["map"]["blocks"], result["map"]["triangles"]])
        header = ["recording", "voxel mm", "total", "fetch", "overlapped", "frames", "blocks",
                  "triangles"]
        return markdown_table(header, rows) if rows else ""

    def _memory(self):
        rows = []
        for cell, result in self.cuda.items():
            memory = result["memory"]

            def both(kind, memory=memory):
                used, reserved = (memory[kind][what] / MIB for what in ("used", "reserved"))
                return f"{used:.1f} / {reserved:.1f}"

            taken = (memory["map"]["reserved"] + memory["mesh"]["reserved"]) / MIB
            rows.append([cell.recording, f"{cell.voxel_mm:g}", both("map"), both("mesh"),
                         f"{taken:.1f}", f"{memory['scratch']['reserved'] / MIB:.1f}",
                         f"{memory['staging']['reserved'] / MIB:.1f}",
                         f"{memory['device'] / MIB:.0f}", f"{memory['whole_mesh'] / MIB:.1f}"])
        header = ["recording", "voxel mm", "map", "mesh", "map and mesh", "scratch",
                  "staging (host)", "process", "whole mesh (host)"]
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

    def _stages(self, results):
        rows = []
        for name in self._stage_names(results):
            row = [name]
            for result in results.values():
                stage = self._stage(result, name)
                row.append(f"{stage['ms']['median']:.3f}" if stage else "–")
            rows.append(row)
        return markdown_table(["stage", *self._columns(results)], rows) if rows else ""

    def _rates(self):
        if not self.gpu:
            return ""
        rates = self.gpu["rates_gb_s"]
        capability = self.gpu["compute_capability"] / 10
        return (f"{self.gpu['name']}, compute capability {capability:.1f}; copies measured at "
                f"{rates['memory']:.0f} GB/s (device memory, read and written), "
                f"{rates['upload']:.0f} and {rates['download']:.0f} GB/s (bus).\n")

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
            rows.append([cell.recording, f"{cell.voxel_mm:g}", cell.threads,
                         spread(result["total_ms"]), number(result["call_ms"]["median"]),
                         result["frames"]])
        header = ["recording", "voxel mm", "threads", "total", "of it integration", "frames"]
        return markdown_table(header, rows) if rows else ""
