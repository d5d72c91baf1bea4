#!/usr/bin/env python3
"""Checks that small maps of every kind are still read correctly and give the same meshes.

check.py MAP_TOOL [--reconstruct RECONSTRUCT] [--backend cpu|cuda] [--write]

Each file in maps/ has these figures:
- "hash", the content hash, after map_tool has verified the file;
- "mesh", the first half of the sha256 of the mesh that map_tool saves;
- "sums", the first half of the sha256 of what examples/python/read_map.py prints, if numpy and
  zstandard are installed.
If the Python module can be imported, loading and saving with it must keep the content hash. Differences
from conformance.txt are printed, and the exit code is 1. If --reconstruct is given and numpy is
installed, the maps that make_maps builds with that program must also have the listed content hashes and meshes.
--write rewrites conformance.txt; use it only after an intended change of the format, fusion or meshes.
"""
import argparse
import hashlib
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
READ_MAP = HERE.parent.parent / "examples" / "python" / "read_map.py"


def run(*command):
    done = subprocess.run([str(word) for word in command], text=True, capture_output=True)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]}: {done.stderr.strip()}")
    return done.stdout


def sha256(data):
    return hashlib.sha256(data).hexdigest()[:32]


def content_hash(tool, path):
    lines = run(tool, "info", path, "--verify").splitlines()
    return next(line.split()[-1] for line in lines if line.startswith("content hash"))


def figures(tool, backend, path, folder):
    """Hashes of the content and of the mesh, which do not depend on the backend or the machine."""
    mesh = folder / "mesh.ply"
    run(tool, "mesh", path, mesh, "--set", f"backend={backend}", "threads=1")
    return {"hash": content_hash(tool, path), "mesh": sha256(mesh.read_bytes())}


def figures_of_readers(tool, backend, path, folder):
    """The figures from the Python readers whose modules are installed."""
    found = {}
    read = subprocess.run([sys.executable, "-B", str(READ_MAP), str(path)], capture_output=True)
    if read.returncode == 0:
        found["sums"] = sha256(read.stdout)
    elif b"No module named" not in read.stderr:
        raise RuntimeError(read.stderr.decode())
    try:
        from dtsdf_mapping import Mapper
    except ImportError:
        return found
    again = folder / "again.dtsdf"
    cells = re.search(r"cells of (\d+) voxels", run(tool, "info", path))  # of free space, if any
    space = {"space/enabled": True, "space/cell_voxels": int(cells[1])} if cells else {}
    Mapper.load(str(path), backend, space).save(str(again))
    if content_hash(tool, again) != content_hash(tool, path):
        found["hash"] = "differs after saving with Python"
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map_tool")
    parser.add_argument("--reconstruct")
    parser.add_argument("--backend", default="cpu")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    table = HERE / "conformance.txt"
    known = {}
    for line in table.read_text().splitlines() if table.exists() else []:
        name, *pairs = line.split()
        known[name] = dict(pair.split("=") for pair in pairs)
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((HERE / "maps").glob("*.dtsdf")):
            found[path.stem] = figures(options.map_tool, options.backend, path, pathlib.Path(folder))
            found[path.stem].update(figures_of_readers(options.map_tool, options.backend, path, pathlib.Path(folder)))
            if options.write and "sums" not in found[path.stem]:
                sys.exit("the figures of read_map.py are missing: use a Python with numpy and zstandard")
        if options.reconstruct and importlib.util.find_spec("numpy"):
            made = pathlib.Path(folder) / "made"
            made.mkdir()
            run(sys.executable, "-B", HERE / "make_maps", options.reconstruct, made)
            for path in sorted(made.glob("*.dtsdf")):
                of_made = figures(options.map_tool, options.backend, path, pathlib.Path(folder))
                found.setdefault(path.stem, of_made).update(of_made)
    lines = [" ".join([name] + [f"{key}={value}" for key, value in found[name].items()]) for name in sorted(found)]
    differ = 0
    for name, of_name in found.items():
        for key, value in of_name.items():
            if known.get(name, {}).get(key) != value and not options.write:
                print(f"{name}: {key} is {value}, not {known.get(name, {}).get(key)}")
                differ += 1
    if options.write:
        table.write_text("\n".join(lines) + "\n")
    print(f"{len(lines)} maps, {differ} figures differ")
    return 1 if differ > 0 or not lines else 0


if __name__ == "__main__":
    sys.exit(main())
