#!/usr/bin/env python3
"""Checks that small maps of all kinds are still read correctly and yield the same meshes.

check.py MAP_TOOL [--reconstruct RECONSTRUCT] [--backend cpu|cuda] [--write]

conformance.txt lists these hashes for each file in maps/:
- "hash", the content hash, after map_tool has verified the file;
- "mesh", the first half of the sha256 of the mesh that map_tool saves;
- "sums", the first half of the sha256 of the output of examples/python/read_map.py, if numpy and
  zstandard are installed.
If the Python module can be imported, loading and saving a map with it must preserve the content hash. If
--reconstruct is given and numpy is installed, the maps that make_maps builds with that program must
also have the listed content hashes and meshes. Prints all differences; the exit code is 1 if there are any.
--write rewrites conformance.txt from all of these; use it only after an intended change of the format,
fusion or meshes, and run make_maps first.
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


def hashes_of(tool, backend, path, folder):
    """Hashes of the content and of the mesh, which do not depend on the backend or the machine."""
    mesh = folder / "mesh.ply"
    run(tool, "mesh", path, mesh, "--set", f"backend={backend}", "threads=1")
    return {"hash": content_hash(tool, path), "mesh": sha256(mesh.read_bytes())}


def hash_of_sums(path):
    """Hash of the output of read_map.py; empty if a module is missing."""
    read = subprocess.run([sys.executable, "-B", str(READ_MAP), str(path)], capture_output=True)
    if read.returncode == 0:
        return {"sums": sha256(read.stdout)}
    if b"No module named" not in read.stderr:
        raise RuntimeError(read.stderr.decode())
    return {}


def is_kept_by_python(tool, backend, path, folder):
    """Whether loading and saving with the Python module, if installed, preserves the content hash."""
    try:
        from dtsdf_mapping import Mapper
    except ImportError:
        return True
    again = folder / "again.dtsdf"
    # The edge of the free-space cells, if the map contains any.
    cells = re.search(r"cells of (\d+) voxels", run(tool, "info", path))
    space = {"space/enabled": True, "space/cell_voxels": int(cells[1])} if cells else {}
    Mapper.load(str(path), backend, space).save(str(again))
    return content_hash(tool, again) == content_hash(tool, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map_tool")
    parser.add_argument("--reconstruct")
    parser.add_argument("--backend", default="cpu")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    rebuilds = bool(options.reconstruct and importlib.util.find_spec("numpy"))
    if options.write and not (rebuilds and importlib.util.find_spec("zstandard")):
        sys.exit("--write needs --reconstruct, and a Python with numpy and zstandard")
    table = HERE / "conformance.txt"
    known = {}
    for line in table.read_text().splitlines() if table.exists() else []:
        name, *pairs = line.split()
        known[name] = dict(pair.split("=") for pair in pairs)
    found = {}  # in --write, what the table shall list
    problems = []

    def check(path, source):
        """Compares the hashes of a map with the table or, in --write, with those of its other source."""
        hashes = hashes_of(options.map_tool, options.backend, path, folder)
        if source == "committed":
            hashes.update(hash_of_sums(path))
        listed = found if options.write else known
        for key, value in hashes.items():
            expected = listed.get(path.stem, {}).get(key)
            if expected != value and (expected or not options.write):
                problems.append(f"{path.stem}: {key} of the {source} map is {value}, expected {expected}")
            found.setdefault(path.stem, {}).setdefault(key, value)

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        committed = sorted((HERE / "maps").glob("*.dtsdf"))
        for path in committed:
            check(path, "committed")
            if not is_kept_by_python(options.map_tool, options.backend, path, folder):
                problems.append(f"{path.stem}: loading and saving with Python changes the content hash")
        missing = {name for name in known if "sums" in known[name]} - {path.stem for path in committed}
        if rebuilds:
            made = folder / "made"
            made.mkdir()
            run(sys.executable, "-B", HERE / "make_maps", options.reconstruct, made)
            rebuilt = sorted(made.glob("*.dtsdf"))
            for path in rebuilt:
                check(path, "rebuilt")
            missing |= set(known) - {path.stem for path in rebuilt}
    if not options.write:
        problems += [f"{name}: its map is missing" for name in sorted(missing)]
    elif not problems:
        lines = [" ".join([name] + [f"{key}={value}" for key, value in found[name].items()]) for name in sorted(found)]
        table.write_text("\n".join(lines) + "\n")
    print("\n".join([*problems, f"{len(found)} maps checked, {len(problems)} problems"]))
    return 1 if problems or not found else 0


if __name__ == "__main__":
    sys.exit(main())
