"""Tables in Markdown from the results of the runs."""
import datetime
import shlex
import sys

from . import published
from .runs import HOUSE, MODES, Cell

BASELINE, PROPOSED = "undirected-vp", "directional-rcn"
METRICS = ("vertices", "surface", "completeness")


def markdown_table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def command_line(script):
    """The command line of this run, without where its files lay on this machine."""
    places = ("--data", "--programs", "--program-dir", "--evaluate-dir", "--work", "--results",
              "--page", "--build", "--voxblox", "--against")
    words, is_place = [f"scripts/{script}"], False
    for word in sys.argv[1:]:
        if not is_place and word.split("=")[0] not in places:
            words.append(word)
        is_place = word in places
    return shlex.join(words)


def made_by(script, device):
    """What made a page, where and when."""
    command = command_line(script)
    return f"Made by `{command}` on {device}, {datetime.date.today().isoformat()}.\n"


def number(value):
    """Three digits, as the published figures have."""
    if value is None:
        return "–"
    return f"{value:.2f}" if value < 10 else f"{value:.1f}"


def triple(values):
    return " / ".join(number(value) for value in values) if values else "–"


def rmse(result):
    return tuple(result["evaluation"][metric]["rmse_mm"] for metric in METRICS)


def shares(ours, others):
    """Each of our figures as a share of another mapper's."""
    if not ours or not others:
        return "–"
    return " / ".join(f"{mine / theirs:.0%}" for mine, theirs in zip(ours, others))


class Tables:
    """Draws the tables of the cells that have a result.

    With `comparable` beside them the figures of others, which are of the paper's set-up: clean
    images of a circle.
    """

    def __init__(self, results, comparable=True):
        self.results = results  # Cell -> result
        self.comparable = comparable
        self.models = sorted({cell.model for cell in results if cell.model != HOUSE})

    def _get(self, model, voxel_mm, mode):
        return self.results.get(Cell(model, voxel_mm, mode))

    def _in_order(self):
        """(cell, result) by model, voxel size and mode."""
        modes = list(MODES)
        return sorted(self.results.items(),
                      key=lambda item: (item[0].model, item[0].voxel_mm, modes.index(item[0].mode)))

    def _voxels(self, models):
        return sorted({cell.voxel_mm for cell in self.results if cell.model in models})

    def _rmse(self, model, voxel_mm, mode):
        result = self._get(model, voxel_mm, mode)
        return rmse(result) if result else None

    def _cells(self, mode):
        """(model, voxel size) of all models that were reconstructed in a mode."""
        return [(model, voxel) for model in self.models for voxel in self._voxels([model])
                if self._get(model, voxel, mode)]

    def accuracy(self):
        """Voxel sizes: the directional map, and an ordinary TSDF."""
        parts = []
        for title, header, rows in (
                ("Directional map, cast along normals", *self._directional_rows()),
                ("Undirected map, voxel projection", *self._undirected_rows())):
            if rows:
                parts.append(f"## {title}\n\n" + markdown_table(header, rows))
        return "\n".join(parts)

    def _directional_rows(self):
        both = bool(self._cells(BASELINE))
        header = ["model", "voxel mm", "this package", "exact distances"]
        if both:
            header.insert(3, "its undirected map")
        if self.comparable:
            header += ["authors' code", "of authors'", "nvblox", "paper (V)"]
        rows = []
        for key in self._cells(PROPOSED):
            ours = self._rmse(*key, PROPOSED)
            row = [key[0], f"{key[1]:g}", triple(ours), triple(published.FLOOR.get(key))]
            if both:
                row.insert(3, triple(self._rmse(*key, BASELINE)))
            if self.comparable:
                authors = published.AUTHORS_CODE[PROPOSED].get(key)
                paper = published.PAPER_TABLE_1.get(key)
                row += [triple(authors), shares(ours, authors),
                        triple(published.NVBLOX.get(key)), number(paper and paper[0])]
            rows.append(row)
        return header, rows

    def _undirected_rows(self):
        header = ["model", "voxel mm", "this package"]
        if not self.comparable:
            return header, []  # stands beside the directional map
        header += ["authors' code", "of authors'", "nvblox", "paper (V)"]
        rows = []
        for key in self._cells(BASELINE):
            ours, authors = self._rmse(*key, BASELINE), published.AUTHORS_CODE[BASELINE].get(key)
            paper = published.PAPER_TABLE_1.get(key)
            rows.append([key[0], f"{key[1]:g}", triple(ours), triple(authors),
                         shares(ours, authors), triple(published.NVBLOX.get(key)),
                         number(paper and paper[1])])
        return header, rows

    def house(self):
        """The house that stands in for the paper's room scenes."""
        rows = []
        for voxel in self._voxels([HOUSE]):
            for mode in MODES:
                result = self._get(HOUSE, voxel, mode)
                if not result:
                    continue
                _, surface, completeness = rmse(result)
                f_score = next(score["f_score"] for score in result["evaluation"]["f_scores"]
                               if abs(score["threshold_mm"] - 25) < 1e-6)
                nvblox = published.NVBLOX_HOUSE.get(voxel)
                authors = published.AUTHORS_HOUSE.get(voxel)
                rows.append([f"{voxel:g}", mode, number(surface), number(completeness),
                             f"{f_score:.3f}",
                             f"{nvblox[0]} / {nvblox[1]} / {nvblox[2]}" if nvblox else "–",
                             f"{authors[2]}" if authors else "–"])
        header = ["voxel mm", "mode", "S", "C", "F at 25 mm", "nvblox: S / C / F",
                  "authors' code: F"]
        return markdown_table(header, rows) if rows else ""

    def modes(self):
        """The six fusion modes at 10 mm."""
        rows = []
        for model in self.models:
            for mode in MODES:
                result = self._get(model, 10, mode)
                if result:
                    paper = published.PAPER_TABLE_3.get(model, {}).get(mode)
                    rows.append([model, mode, triple(rmse(result)), number(paper)])
        compares = len({cell.mode for cell in self.results if cell.voxel_mm == 10}) > 2
        header = ["model", "mode", "this package", "paper (V)"]
        return markdown_table(header, rows) if compares else ""

    def topology(self):
        """Slits and pieces: a closed surface seen from all sides should have neither."""
        rows = []
        for cell, result in self._in_order():
            topology = result["evaluation"]["topology"]
            authors = None
            if cell.mode == PROPOSED and self.comparable:
                authors = published.AUTHORS_TOPOLOGY.get((cell.model, cell.voxel_mm))
            rows.append([cell.model, f"{cell.voxel_mm:g}", cell.mode, topology["triangles"],
                         topology["boundary_edges"], topology["non_manifold_edges"],
                         topology["components"], topology["degenerate_triangles"]] +
                        ([f"{authors[0]} / {authors[1]}" if authors else "–"]
                         if self.comparable else []))
        header = ["model", "voxel mm", "mode", "triangles", "boundary edges", "non-manifold edges",
                  "components", "degenerate"]
        if self.comparable:
            header.append("authors' code: boundary edges / components")
        return markdown_table(header, rows) if rows else ""

    def cost(self):
        """Voxel arrays per block, and update time split into integration and meshing."""
        rows = []
        for cell, result in self._in_order():
            rows.append([cell.model, f"{cell.voxel_mm:g}", cell.mode] +
                        self._cost_of(cell, result["report"]))
        header = ["model", "voxel mm", "mode", "blocks", "arrays per block", "MiB",
                  "integration ms", "meshing ms", "share of meshing", "paper: ms (share)",
                  "authors' code: ms"]
        timed = any(result["report"]["mesh_updates"] > 1 for result in self.results.values())
        return markdown_table(header, rows) if timed else ""

    @staticmethod
    def _cost_of(cell, report):
        size = [report["blocks"], f"{report['voxel_arrays'] / max(1, report['blocks']):.2f}",
                f"{report['map_bytes'] / 2**20:.1f}"]
        if report["mesh_updates"] <= 1:  # not timed
            return size + ["–"] * 5
        integrate, mesh = report["integrate_ms"]["mean"], report["mesh_ms"]["mean"]
        paper = authors = None
        if cell.model == "asian_dragon":
            paper = published.PAPER_TIMES.get(cell.mode, {}).get(cell.voxel_mm)
            authors = published.AUTHORS_TIMES.get(cell.mode, {}).get(cell.voxel_mm)
        return size + [number(integrate), number(mesh),
                       f"{mesh / max(1e-9, integrate + mesh):.0%}",
                       f"{paper[0]} ({paper[1]:.0%})" if paper else "–",
                       f"{authors[0]} + {authors[1]}" if authors else "–"]
