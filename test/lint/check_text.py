#!/usr/bin/env python3
"""Finds external text that is shown unchanged in logs, messages and responses: names from messages and
files, and texts of exceptions. Such text must pass through printable(), printableMessage() or errorText()
(src/params/printable.h). Also finds numbers whose format depends on the locale of the host program: use
formatted() and parseNumber() (src/params/text.h). Prints file:line of each violation.

Usage: check_text.py ROOT
"""
import pathlib
import re
import sys

FOLDERS = ("src/ros", "src/io", "src/map", "src/program", "src/tools", "lab")
SUFFIXES = {".h", ".cpp"}

# Members with external text.
FROM_OUTSIDE = re.compile(
    r"(\.|->)(distortion_model|frame_id|child_frame_id|encoding|map_frame|file_name)\b(?!\.empty)"
    r"|\bfile_name\b(?!\.empty)|\bgetPublisherName\(\)|\bheader\.name\(\)")
CLEANED = re.compile(r"\b(printable|printableMessage|errorText|startErrorText|shownName)\(")
# A concatenated string: a literal next to + or <<.
JOINED = re.compile(r'(\+|<<)\s*"|"\s*(\+|<<)')
# The text of an exception may go into another exception, which is cleaned when it is shown.
WHAT = re.compile(r"\b\w+\.what\(\)")
RETHROWN = re.compile(r"\bthrow|\bUsageError\(|\bproblem = |\breturn error\.what")
# Functions that depend on the locale, except printf() and fprintf(), which only our own programs call.
BY_LOCALE = re.compile(r"\b(strto[dfl]d?|ato[fil]|sto[dfl]d?|v?sn?printf|v?f?scanf|vsscanf|setlocale)\("
                       r"|\bto_string\(\w*(_m|_s|_deg|_mb|_hz|seconds)\)")
STREAM = re.compile(r"std::o?stringstream (\w+)$")
# These files clean texts at the point where they are shown.
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
    """The statement without the arguments of cleaning calls."""
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
    """Finds numbers that are written or read in the locale's format."""
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
            violations.append(f"{path}:{line}: external text is shown unchanged; use printable()")
        if WHAT.search(rest) and not RETHROWN.search(rest):
            violations.append(f"{path}:{line}: an exception's text is shown unchanged; use "
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
