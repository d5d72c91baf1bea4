"""What the scripts that measure the package and write a page have in common."""
import argparse
import json
import os
import pathlib
import subprocess
import sys

from .runs import find_programs

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MAPS = {"directional": ["map/directional=true"],
        "undirected": ["map/directional=false", "fusion/mode=voxel_projection"]}


def make_parser(doc, work="", data=""):
    """With the options of all; `work` names a folder for files in between, and `data` says what is
    read of the folder --data, where there are such."""
    parser = argparse.ArgumentParser(description=doc,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)

    def add_folder(*names, default, what=""):
        parser.add_argument(*names, type=pathlib.Path, default=default,
                            help=f"{what}default: %(default)s")

    if data:
        parser.add_argument(
            "--data", type=pathlib.Path,
            default=os.environ.get("DTSDF_DATA_DIR", ROOT.parent / "shared" / "data"),
            help=f"folder with {data} (default: $DTSDF_DATA_DIR, or ../shared/data)")
    parser.add_argument("--backend", default="auto",
                        help="auto, cpu or cuda (default: %(default)s)")
    add_folder("--programs", "--program-dir", default=find_programs(ROOT),
               what="folder of the programs; ")
    if work:
        add_folder("--work", default=ROOT / "out" / work)
    add_folder("--results", default=ROOT / "docs" / "results", what="folder of the page; ")
    return parser


def run(program, *arguments, **more):
    """What a program prints."""
    command = [str(word) for word in (program, *arguments)]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, **more).stdout


def reconstruct(options, folder, voxel_mm, settings, mesh, *arguments):
    """Fuses a TUM folder into a mesh; returns the report."""
    report = pathlib.Path(mesh).with_suffix(".report.json")
    run(options.programs / "reconstruct", "--tum", folder, "--backend", options.backend, "--mesh",
        mesh, "--report", report, *arguments, "--set", f"map/voxel_size_m={voxel_mm / 1000:g}",
        *settings)
    return json.loads(report.read_text())


def fill_page(path, script, **parts):
    """Puts each text between the marks of its name; what is written around them stays. On a page
    without its marks it goes to the end, with them."""
    path.parent.mkdir(parents=True, exist_ok=True)
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    for name, text in parts.items():
        begin, end = f"<!-- {name}: by scripts/{script} -->\n", f"<!-- /{name} -->\n"
        if begin not in page:
            page += ("\n" if page else "") + begin + end
        head, _, rest = page.partition(begin)
        if end not in rest:
            sys.exit(f"error: {path}: no line '{end.strip()}' after '{begin.strip()}'")
        page = f"{head}{begin}\n{text.strip()}\n\n{end}{rest.partition(end)[2]}"
    path.write_text(page, encoding="utf-8")
    print(page)
