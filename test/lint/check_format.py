#!/usr/bin/env python3
"""Checks that C++ and CUDA files are formatted according to .clang-format. Exits with 77 (skipped) without
clang-format 14, because other versions format differently.

Usage: check_format.py [--fix] ROOT     --fix formats all files
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


def find_clang_format():
    """The clang-format of the required version, or None."""
    for name in (f"clang-format-{VERSION}", "clang-format"):
        path = shutil.which(name)
        if path is None:
            continue
        text = subprocess.run([path, "--version"], check=True, text=True,
                              stdout=subprocess.PIPE).stdout
        if re.search(rf"version {VERSION}\.", text):
            return path
    return None


def unformatted(program, root, paths):
    """The files that are not formatted."""
    if not paths:
        return set()
    done = subprocess.run([program, "--dry-run", *paths], cwd=root, text=True, check=True,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return set(re.findall(r"^(\S+?):\d+:\d+: ", done.stderr, flags=re.M))


def main(arguments):
    fix = "--fix" in arguments
    root = pathlib.Path(next(a for a in arguments if a != "--fix"))
    program = find_clang_format()
    if program is None:
        print(f"skipped: no clang-format of version {VERSION}")
        return SKIPPED
    paths = sorted(file.relative_to(root).as_posix() for folder in FOLDERS
                   for file in (root / folder).rglob("*") if file.suffix in SUFFIXES)
    if fix and paths:
        subprocess.run([program, "-i", *paths], cwd=root, check=True)
    found = sorted(unformatted(program, root, paths))
    for path in found:
        print(f"{path}: not formatted; run test/lint/check_format.py --fix .")
    print(f"{len(paths)} files, {len(found)} violations")
    return 1 if found or not paths else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
