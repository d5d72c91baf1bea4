#!/usr/bin/env python3
"""Checks that the documentation agrees with the code: check_docs.py ROOT.

- Relative links in Markdown files lead to existing files and headings.
- Source files and scripts named in pages exist, and so do pages named in the code.
- The table in docs/method.md lists exactly the rule parameters, with their defaults.
- src/backend/rules.h visits each rule parameter.
- docs/ros.md names every key of config/default.yaml.
- package.xml and CMakeLists.txt have the same version.
- No page, message, settings file, launch file or public header uses awkward wording (WORDS).
"""
import pathlib
import re
import sys

RULES = {"SurfelRules": "surfels", "FusionRules": "fusion", "ColourRules": "colour",
         "MeshRules": "mesh", "AlignmentRules": "poses"}
# {pattern: what to write instead}.
WORDS = {r"\b(tells?|told|telling)\b": "report, print, show, indicate", r"\banew\b": "again",
         r"\b(go|goes|going|gone) on\b": "continue", r"\bpassed over\b": "skipped",
         r"\bis none of\b": "is not", r"\bhas to be\b": "must be", r"\bany more\b": "no longer",
         r"\btake another\b": "choose another", r"\ba text\b|\btexts\b": "a string, strings"}
# Folders that file names may be relative to; "" is the root.
BASES = ("", "src", "lab", "src/kernels", "include/dtsdf_mapping", "cuda", "docs")


def pages(root):
    return [*sorted(root.glob("*.md")), *sorted((root / "docs").rglob("*.md")),
            *sorted((root / "lab").glob("*.md"))]


def without_code(text):
    return re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)


def anchors(path):
    """The anchors that GitHub generates for a page's headings."""
    found = set()
    for heading in re.findall(r"^#+ +(.*)$", without_code(path.read_text(encoding="utf-8")),
                              flags=re.MULTILINE):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        found.add(re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-"))
    return found


def check_links(path):
    text = without_code(path.read_text(encoding="utf-8"))
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (path.parent / name) if name else path
        if not target.exists():
            yield f"link to {link}: no such file"
        elif anchor and target.suffix == ".md" and anchor not in anchors(target):
            yield f"link to {link}: no such heading"


def check_named_files(path, root):
    text = path.read_text(encoding="utf-8")
    names = set(re.findall(r"`([\w./-]+/[\w.-]+\.(?:h|cuh|cu|cpp|py|yaml|launch))`", text))
    names |= set(re.findall(r"(?<![\w/.-])(scripts/\w+)", text))
    for name in sorted(names):
        if not any((root / base / name).exists() for base in BASES):
            yield f"names {name}, which does not exist"


def check_named_pages(root):
    for folder in ("include", "src", "cuda"):
        for path in sorted((root / folder).rglob("*")):
            if not path.is_file():
                continue
            text = path.read_text(encoding="utf-8", errors="replace")
            for name in sorted(set(re.findall(r"\bdocs/[\w/]+\.md\b", text))):
                if not (root / name).exists():
                    yield f"{path.relative_to(root)}: names {name}, which does not exist"


def value_of(text):
    """Parses a number, or a quotient of two, as written in C++ or in the table."""
    parts = [float(part.strip().rstrip("f")) for part in text.split("/")]
    return parts[0] / parts[1] if len(parts) == 2 else parts[0]


def rules_in_code(root):
    """{key: default} of every rule parameter."""
    found = {}
    for path in sorted((root / "src" / "kernels").rglob("*_rules.h")):
        text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        for name, body in re.findall(r"struct (\w+Rules) \{(.*?)^\};", text,
                                     flags=re.DOTALL | re.MULTILINE):
            for member, default in re.findall(r"^\s*\w+ (\w+) = ([^;]+);", body, flags=re.MULTILINE):
                found[f"rules/{RULES[name]}/{member}"] = value_of(default)
    return found


def rules_in_docs(root):
    text = (root / "docs" / "method.md").read_text(encoding="utf-8")
    return {key: value_of(default)
            for key, default in re.findall(r"^\| `(rules/[\w/]+)` \| ([^|]+) \|", text, re.MULTILINE)}


def check_rules(root):
    code, docs = rules_in_code(root), rules_in_docs(root)
    for key in sorted(code.keys() - docs.keys()):
        yield f"{key} is missing"
    for key in sorted(docs.keys() - code.keys()):
        yield f"{key} is not in the code"
    for key in sorted(code.keys() & docs.keys()):
        if abs(code[key] - docs[key]) > 1e-9:
            yield f"{key} is {code[key]:g}, not {docs[key]:g}"


def check_visits(root):
    """Finds rule parameters that rules.h does not visit: they could not be set or saved in a map."""
    text = (root / "src" / "backend" / "rules.h").read_text(encoding="utf-8")
    visited = {section + name for section, body in
               re.findall(r'section = "(rules/\w+/)";(.*?)(?=section = |^\})', text,
                          flags=re.DOTALL | re.MULTILINE)
               for name in re.findall(r'visit\(section \+ "(\w+)"', body)}
    for key in sorted(rules_in_code(root).keys() - visited):
        yield f"{key} is not visited"


def settings_in(config):
    """The keys of a settings file: sections and their members."""
    section = ""
    for line in config.read_text(encoding="utf-8").splitlines():
        match = re.match(r"( *)(\w+):(.*)", line)
        if not match:
            continue
        indent, key, value = match.groups()
        if indent:
            yield f"{section}/{key}"
        elif value.split("#")[0].strip():
            yield key
        else:
            section = key


def check_settings(root):
    text = (root / "docs" / "ros.md").read_text(encoding="utf-8")
    for key in settings_in(root / "config" / "default.yaml"):
        if f"`{key}`" not in text:
            yield f"{key} of config/default.yaml is missing"


def check_version(root):
    versions = {re.search(pattern, (root / name).read_text(encoding="utf-8"))[1]
                for name, pattern in (("package.xml", r"<version>([\d.]+)<"),
                                      ("CMakeLists.txt", r"project\(\w+ VERSION ([\d.]+)"))}
    if len(versions) > 1:
        yield f"package.xml and CMakeLists.txt have different versions: {', '.join(versions)}"


def check_words(root):
    """Finds awkward wording, also across line breaks."""
    for pattern in ("README.md", "SECURITY.md", "docs/*.md", "msg/*", "srv/*", "cfg/*",
                    "config/*.yaml", "launch/*.launch", "include/**/*.h"):
        for path in sorted(filter(pathlib.Path.is_file, root.glob(pattern))):
            text = path.read_text(encoding="utf-8")
            for word, instead in WORDS.items():
                for found in re.finditer(word.replace(" ", r"\s+"), text, re.IGNORECASE):
                    line = 1 + text.count("\n", 0, found.start())
                    yield f"{path.relative_to(root)}:{line}: '{found[0]}'; write: {instead}"


def problems(root):
    for path in pages(root):
        name = path.relative_to(root)
        yield from (f"{name}: {text}" for text in check_links(path))
        yield from (f"{name}: {text}" for text in check_named_files(path, root))
    yield from check_named_pages(root)
    yield from (f"docs/method.md: {text}" for text in check_rules(root))
    yield from (f"src/backend/rules.h: {text}" for text in check_visits(root))
    yield from (f"docs/ros.md: {text}" for text in check_settings(root))
    yield from check_version(root)
    yield from check_words(root)


def main():
    found = list(problems(pathlib.Path(sys.argv[1]).resolve()))
    for problem in found:
        print(problem)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
