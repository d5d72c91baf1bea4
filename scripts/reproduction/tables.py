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


def made_by(script, device):
    """The command line of this run, where it ran and when."""
    command = shlex.join([f"scripts/{script}"] + sys.argv[1:])
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


def verdict(ours, authors):
    """How each of our three figures compares with that of the authors' code."""
    if not authors:
        return "–"
    words = []
    for mine, theirs in zip(ours, authors):
        words.append("half" if mine <= theirs / 2 else "better" if mine <= theirs else "**worse**")
    return " / ".join(words)


def deviation(ours, authors):
    """How far each figure is from that of the authors' code, in per cent."""
    if not authors:
        return "–"
    return " / ".join(f"{100 * (mine / theirs - 1):+.0f} %" for mine, theirs in zip(ours, authors))


class Tables:
    """Draws the tables of the cells that have a result."""

    def __init__(self, results):
        self.results = results  # Cell -> result
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

    def table_1(self):
        """Voxel sizes: the undirected baseline against the directional map."""
        parts = []
        for mode in (BASELINE, PROPOSED):
            rows = []
            for model in self.models:
                for voxel in self._voxels([model]):
                    result = self._get(model, voxel, mode)
                    if result:
                        rows.append(self._table_1_row(model, voxel, mode, result))
            if rows:
                header = ["model", "voxel mm", "ours", "authors' code", "ours against it",
                          "nvblox", "floor", "paper (vertex)"]
                parts.append(f"## {mode}\n\n" + markdown_table(header, rows))
        return "\n".join(parts)

    def verdicts(self):
        """Each cell of the proposed mode as a share of the figures of the authors' code."""
        rows, ratios = [], []
        for cell, result in self._in_order():
            key = (cell.model, cell.voxel_mm)
            authors = published.AUTHORS_CODE[PROPOSED].get(key)
            if cell.mode != PROPOSED or not authors:
                continue
            shares = [mine / theirs for mine, theirs in zip(rmse(result), authors)]
            ratios += shares
            slits = result["evaluation"]["topology"]["boundary_edges"]
            theirs = published.AUTHORS_TOPOLOGY.get(key)
            rows.append([cell.model, f"{cell.voxel_mm:g}", *(f"{share:.0%}" for share in shares),
                         "no worse" if max(shares) <= 1 else "**worse**",
                         f"{sum(share <= 0.5 for share in shares)} of 3", slits,
                         f"{theirs[0]} ({slits / theirs[0]:.0%})" if theirs else "–"])
        if not rows:
            return ""
        header = ["model", "voxel mm", *METRICS, "all three", "at most half", "boundary edges",
                  "authors' code: boundary edges (ours of theirs)"]
        return (markdown_table(header, rows) +
                f"\n{len(ratios)} figures: {sum(r <= 1 for r in ratios)} are no worse, "
                f"{sum(r <= 0.5 for r in ratios)} at most half.\n")

    @staticmethod
    def _table_1_row(model, voxel, mode, result):
        key = (model, voxel)
        authors = published.AUTHORS_CODE[mode].get(key)
        paper = published.PAPER_TABLE_1.get(key)
        paper_rmse = paper[0 if mode == PROPOSED else 1] if paper else None
        compare = verdict if mode == PROPOSED else deviation
        return [model, f"{voxel:g}", triple(rmse(result)), triple(authors),
                compare(rmse(result), authors), triple(published.NVBLOX.get(key)),
                triple(published.FLOOR.get(key)), number(paper_rmse)]

    def table_2(self):
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
        header = ["voxel mm", "mode", "surface RMSE", "completeness RMSE", "F at 25 mm",
                  "nvblox: surface / completeness / F", "authors' code: F"]
        return markdown_table(header, rows) if rows else ""

    def table_3(self):
        """The six fusion modes at 10 mm."""
        rows = []
        for model in self.models:
            for mode in MODES:
                result = self._get(model, 10, mode)
                if result:
                    paper = published.PAPER_TABLE_3.get(model, {}).get(mode)
                    rows.append([model, mode, triple(rmse(result)), number(paper)])
        compares = len({cell.mode for cell in self.results if cell.voxel_mm == 10}) > 2
        return markdown_table(["model", "mode", "ours", "paper (vertex)"], rows) if compares else ""

    def topology(self):
        """Slits and pieces: a closed surface seen from all sides should have neither."""
        rows = []
        for cell, result in self._in_order():
            topology = result["evaluation"]["topology"]
            authors = None
            if cell.mode == PROPOSED:
                authors = published.AUTHORS_TOPOLOGY.get((cell.model, cell.voxel_mm))
            rows.append([cell.model, f"{cell.voxel_mm:g}", cell.mode, topology["triangles"],
                         topology["boundary_edges"], topology["non_manifold_edges"],
                         topology["components"], topology["degenerate_triangles"],
                         f"{authors[0]} / {authors[1]}" if authors else "–"])
        header = ["model", "voxel mm", "mode", "triangles", "boundary edges", "non-manifold edges",
                  "components", "degenerate", "authors' code: boundary edges / components"]
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
