"""Helpers shared by all cases: options, programs, tables and pages."""
import argparse
import datetime
import json
import os
import pathlib
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MAPS = {"directional": ["map/directional=true"],
        "undirected": ["map/directional=false", "fusion/mode=voxel_projection"]}
# Options whose values are local paths, which must not appear on the pages.
PLACES = ("--data", "--programs", "--work", "--results",
          "--page", "--voxblox", "--against", "--raw", "--peer", "--gpu-peer")


def find_programs():
    """The folder with the programs of this checkout, built with or without ROS."""
    for folder in ("build/devel/lib/dtsdf_mapping", "build/bin"):
        if (ROOT / folder / "reconstruct").exists():
            return ROOT / folder
    return ROOT / "build/bin"


def make_parser(doc, work="", data=""):
    """Returns a parser with the options common to all cases. `work` is the name of the folder for
    intermediate files, and `data` says what --data must contain; if empty, the option is left out."""
    parser = argparse.ArgumentParser(description=doc,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)

    def add_folder(*names, default, what=""):
        parser.add_argument(*names, type=pathlib.Path, default=default,
                            help=f"{what}default: %(default)s")

    if data:
        add_folder("--data", what=f"folder with {data}; ",
                   default=os.environ.get("DTSDF_DATA_DIR", ROOT.parent / "shared" / "data"))
    parser.add_argument("--backend", default="auto",
                        help="auto, cpu or cuda (default: %(default)s)")
    add_folder("--programs", default=find_programs(),
               what="folder of the programs; ")
    if work:
        add_folder("--work", default=ROOT / "out" / work)
    add_folder("--results", default=ROOT / "docs" / "results", what="folder of the page; ")
    return parser


def words(text):
    return [word for word in text.split(",") if word]


def numbers(text):
    return [float(word) for word in words(text)]


def run(program, *arguments, **more):
    """Runs a program and returns what it prints."""
    command = [str(word) for word in (program, *arguments)]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, **more).stdout


def reconstruct(options, folder, voxel_mm, settings, mesh, *arguments, poses="tf"):
    """Reconstructs a mesh from a TUM folder, by default at the poses in the folder; returns the report."""
    report = pathlib.Path(mesh).with_suffix(".report.json")
    run(options.programs / "reconstruct", "--tum", folder, "--backend", options.backend,
        "--poses-mode", poses, "--mesh", mesh, "--report", report, *arguments, "--set",
        f"map/voxel_size_m={voxel_mm / 1000:g}", *settings)
    return json.loads(report.read_text())


def render(options, model, folder, *arguments):
    """Renders images of a mesh in --data into a folder, unless they are already there."""
    if not (folder / "groundtruth.txt").exists():
        run(options.programs / "render_orbit", options.data / model, folder, *arguments)
    return folder


def markdown_table(header, rows):
    """A table in Markdown. A first cell equal to the one above is left blank."""
    lines, above = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)], None
    for first, *cells in rows:
        lines.append(" | ".join(["|" if first == above else f"| {first}", *map(str, cells)]) + " |")
        above = first
    return "\n".join(lines) + "\n"


def number(value):
    """Formats with two decimals below 10, one below 100, and none from 100 on."""
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:.0f}"


def cpu_name():
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else 'unknown processor'}, {os.cpu_count()} cores"


def made_by(device):
    """A line that gives the command of this run (without paths), the device and the date."""
    shown, is_place = [], False
    for word in sys.argv[1:]:
        if not is_place and word.split("=")[0] not in PLACES:
            shown.append(word)
        is_place = word in PLACES
    command = f"scripts/{pathlib.Path(sys.argv[0]).name} {shlex.join(shown)}".strip()
    return f"Made by `{command}` on {device}, {datetime.date.today().isoformat()}.\n"


def fill_page(path, **parts):
    """Replaces the text between the markers of each named part of a page. Appends missing markers."""
    path.parent.mkdir(parents=True, exist_ok=True)
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    for name, text in parts.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- /{name} -->\n"
        if begin not in page:
            page += ("\n" if page else "") + begin + end
        head, _, rest = page.partition(begin)
        if end not in rest:
            sys.exit(f"error: {path}: no line '{end.strip()}' after '{begin.strip()}'")
        page = f"{head}{begin}\n{text.strip()}\n\n{end}{rest.partition(end)[2]}"
        print(text.strip())
    path.write_text(page, encoding="utf-8")
