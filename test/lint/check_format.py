#!/usr/bin/env python3
"""Checks that C++ files are formatted as .clang-format says, but for those that unformatted.txt
lists; a file that is formatted must not stay on that list. Exits 77 without clang-format 14: other
versions format otherwise.

Usage: check_format.py [--fix] ROOT     --fix formats all files that are not listed
"""
import pathlib
import re
import shutil
import subprocess
import sys

VERSION = 14
SKIPPED = 77
FOLDERS = ("include", "src", "cuda", "lab", "examples", "test")
SUFFIXES = {".h", ".cpp", ".cu", ".cuh"}
LIST = pathlib.Path(__file__).resolve().with_name("unformatted.txt")


def find_clang_format():
    """The program of the version that counts, or None."""
    for name in (f"clang-format-{VERSION}", "clang-format"):
        path = shutil.which(name)
        if path is None:
            continue
        text = subprocess.run([path, "--version"], check=True, text=True,
                              stdout=subprocess.PIPE).stdout
        if re.search(rf"version {VERSION}\.", text):
            return path
    return None


def read_list(text):
    """Files, and folders that end with a slash; lines that begin with # are comments."""
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def is_listed(path, listed):
    return any(path == entry or entry.endswith("/") and path.startswith(entry) for entry in listed)


def unformatted(program, root, paths):
    """Those of the files that are not formatted."""
    if not paths:
        return set()
    done = subprocess.run([program, "--dry-run", *paths], cwd=root, text=True, check=True,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return set(re.findall(r"^(\S+?):\d+:\d+: ", done.stderr, flags=re.M))


def violations(paths, listed, is_unformatted):
    """What is wrong with each file; `is_unformatted` gives those of some files that are not
    formatted."""
    for path in sorted(is_unformatted([p for p in paths if not is_listed(p, listed)])):
        yield f"{path}: not formatted; run test/lint/check_format.py --fix ."
    files = [entry for entry in listed if not entry.endswith("/")]
    for path in sorted(set(files) - set(paths)):
        yield f"{LIST.name}: there is no {path}; take the line out"
    there = [path for path in files if path in paths]
    for path in sorted(set(there) - is_unformatted(there)):
        yield f"{LIST.name}: {path} is formatted; take the line out"


def main(arguments):
    fix = "--fix" in arguments
    root = pathlib.Path(next(a for a in arguments if a != "--fix"))
    program = find_clang_format()
    if program is None:
        print(f"skipped: there is no clang-format of version {VERSION}")
        return SKIPPED
    paths = sorted(file.relative_to(root).as_posix() for folder in FOLDERS
                   for file in (root / folder).rglob("*") if file.suffix in SUFFIXES)
    listed = read_list(LIST.read_text(encoding="utf-8"))
    if fix:
        subprocess.run([program, "-i", *(p for p in paths if not is_listed(p, listed))], cwd=root,
                       check=True)
    found = list(violations(paths, listed, lambda files: unformatted(program, root, files)))
    print("\n".join(found + [f"{len(paths)} files, {len(found)} violations"]))
    return 1 if found or not paths else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
