#!/usr/bin/env python3
"""Finds text from outside that goes into logs, messages and answers as it came: names in messages and
files, and what exceptions say. It has to go through printable(), printableMessage() or errorText()
(src/params/printable.h). Finds numbers that the locale of a host program would change, too: they
are written by formatted() and read by parseNumber() (src/params/text.h). Prints file:line of each
violation.

Usage: check_text.py ROOT
"""
import pathlib
import re
import sys

FOLDERS = ("src/ros", "src/io", "src/map", "src/program", "src/tools", "lab")
SUFFIXES = {".h", ".cpp"}

# Members that hold what others chose.
FROM_OUTSIDE = re.compile(
    r"(\.|->)(distortion_model|frame_id|child_frame_id|encoding|map_frame|file_name)\b(?!\.empty)"
    r"|\bfile_name\b(?!\.empty)|\bgetPublisherName\(\)|\bheader\.name\(\)")
CLEANED = re.compile(r"\b(printable|printableMessage|errorText|startErrorText|shownName)\(")
# A text that is put together: a literal beside + or <<.
JOINED = re.compile(r'(\+|<<)\s*"|"\s*(\+|<<)')
# What an exception says may go into another exception, which is cleaned where it goes out.
WHAT = re.compile(r"\b\w+\.what\(\)")
RETHROWN = re.compile(r"\bthrow|\bUsageError\(|\bproblem = |\breturn error\.what")
# What follows the locale, outside of what is printed by a program of our own.
BY_LOCALE = re.compile(r"\b(strto[dfl]d?|ato[fil]|sto[dfl]d?|v?sn?printf|v?f?scanf|vsscanf|setlocale)\("
                       r"|\bto_string\(\w*(_m|_s|_deg|_mb|_hz|seconds)\)")
STREAM = re.compile(r"std::o?stringstream (\w+)$")
# Where it is cleaned.
CLEANERS = {"src/program/run_program.cpp", "src/ros/common/node_start.h"}


def statements(code):
    """(line, text) of each statement, without comments."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: re.sub(r"[^\n]", " ", m.group(0)), code, flags=re.S)
    line, begin = 1, 0
    in_text = False
    for at, c in enumerate(code):
        if c == '"' and code[at - 1] != "\\":
            in_text = not in_text
        if c in ";{}" and not in_text:
            text = code[begin:at]
            blank = len(text) - len(text.lstrip())
            yield line + text[:blank].count("\n"), text.strip()
            line += text.count("\n")
            begin = at + 1


def without_cleaned(text):
    """The statement without what is inside of calls that clean it."""
    while True:
        call = CLEANED.search(text)
        if not call:
            return text
        depth, end = 1, call.end()
        while depth and end < len(text):
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            end += 1
        text = text[:call.start()] + "CLEAN" + text[end:]


def by_locale(path, code):
    """Numbers that are written or read as the locale has it."""
    for line, text in statements(code):
        stream = STREAM.search(text)
        if BY_LOCALE.search(text) or (stream and f"{stream.group(1)}.imbue(" not in code):
            yield f"{path}:{line}: depends on the locale; use formatted(), parseNumber() or imbue()"


def check(path, code):
    violations = []
    if path in CLEANERS:
        return violations
    if path.startswith(("include", "src", "cuda")) and path != "src/params/text.h":
        violations += by_locale(path, code)
    if not path.startswith(FOLDERS):
        return violations
    for line, text in statements(code):
        rest = without_cleaned(text)
        names = re.sub(r'"(?:\\.|[^"\\])*"', '""', rest)
        if FROM_OUTSIDE.search(names) and JOINED.search(rest):
            violations.append(f"{path}:{line}: text from outside is shown as it came; use printable()")
        if WHAT.search(rest) and not RETHROWN.search(rest):
            violations.append(f"{path}:{line}: what an exception says is shown as it came; use "
                              "errorText()")
    return violations


def main(root):
    root = pathlib.Path(root)
    files = [p for folder in ("include", "src", "cuda", "lab") for p in sorted((root / folder).rglob("*"))
             if p.suffix in SUFFIXES]
    violations = [v for p in files
                  for v in check(p.relative_to(root).as_posix(), p.read_text(encoding="utf-8"))]
    print("\n".join(violations + [f"{len(files)} files checked, {len(violations)} violations"]))
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
