#!/usr/bin/env python3
"""Finds wording that readers stumble over, in pages and in what programs print: check_words.py ROOT.

Looks at the pages beside docs/results, the texts of messages, services, settings, launch files and public
headers, and the string literals of the code. CONTRIBUTING.md has the rule, and so quotes what is not to be written.
"""
import pathlib
import re
import sys

# What is found, and what to write instead.
WORDS = [
    (r"\b(tells?|told|telling)\b", "report, print, show, indicate"),
    (r"\banew\b", "again"),
    (r"\b(go|goes|going|gone) on\b", "continue, resume"),
    (r"\btime stands still\b", "/clock is not advancing"),
    (r"\bpassed over\b", "skipped"),
    (r"\bfor whose sake\b", "because of"),
    (r"\bat the very\b", "at the"),
    (r"\bleads? out of\b", "is outside"),
    (r"\bbound of the (rate|mesh)\b", "maximum"),
    (r"\bis none of\b", "is not"),
    (r"(?<!there) is no (?!longer|more|less|such|measurement)", "is not a"),
    (r"\bhas to be\b", "must be"),
    (r"\bany more\b", "no longer"),
    (r"\bweighed by\b", "weighted by"),
    (r"\btake another\b", "choose another"),
    (r"\ba text\b|\btexts\b", "a string, strings"),
    (r"\bis of \d", "is stamped"),
    (r"\bis (never |while )?still\b(?=,| at)", "at rest"),
    (r"\bas many or\b", "0 to, at least"),
    (r"\bgo(es)? first\b", "is deleted first, comes first"),
    (r"\bgives? a message\b", "publishes a message"),
    (r"\bmotion leads\b", "predicted by the motion"),
    (r"\bin the hand\b", "hand-held"),
]
# Sentences run on over lines.
PATTERNS = [(re.compile(pattern.replace(" ", r"\s+"), re.IGNORECASE), instead)
            for pattern, instead in WORDS]

PAGES = ("README.md", "SECURITY.md", "docs/*.md")
TEXTS = ("msg/*", "srv/*", "cfg/*", "config/*.yaml", "launch/*.launch", "include/**/*.h")
CODE = ("src/**/*.h", "src/**/*.cpp", "lab/**/*.h", "lab/**/*.cpp", "examples/*.cpp")
# Rules and loops of a backend print nothing.
LEFT_OUT = ("src/kernels/", "src/cpu/")


def files(root, patterns):
    for pattern in patterns:
        for path in sorted(root.glob(pattern)):
            name = path.relative_to(root).as_posix()
            if path.is_file() and not name.startswith(LEFT_OUT):
                yield name, path.read_text(encoding="utf-8")


def literals(code):
    """(line, text) of each string literal; those that are split over lines are one."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: re.sub(r"[^\n]", " ", m.group(0)), code,
                  flags=re.DOTALL)
    part = r'"(?:\\.|[^"\\\n])*"'
    for match in re.finditer(rf"{part}(?:\s*\n\s*{part})*", code):
        text = "".join(piece[1:-1] for piece in re.findall(part, match.group(0)))
        yield 1 + code.count("\n", 0, match.start()), text


def problems(root):
    for name, text in [*files(root, PAGES), *files(root, TEXTS)]:
        yield from found(name, 1, text)
    for name, code in files(root, CODE):
        for line, text in literals(code):
            yield from found(name, line, text)


def found(name, first_line, text):
    for pattern, instead in PATTERNS:
        for match in pattern.finditer(text):
            line = first_line + text.count("\n", 0, match.start())
            words = " ".join(match.group(0).split())
            yield f"{name}:{line}: '{words}'; write: {instead}"


def main(root):
    violations = list(problems(pathlib.Path(root).resolve()))
    print("\n".join(violations + [f"{len(violations)} violations"]))
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
