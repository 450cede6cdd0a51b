#!/usr/bin/env python3
"""Checks the documentation: README.md has at most 150 lines and 1200 words, relative links of all *.md lead somewhere, and the commands
and options that README.md, docs/ and the other pages name exist in the program (argument 1, or $MUSICWORLD_PROGRAM)."""
import os
import re
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
PROGRAM = (sys.argv[1:] or [os.environ.get("MUSICWORLD_PROGRAM", str(TOP / "build/release/app/musicworld"))])[0]
MOST_LINES, MOST_WORDS = 150, 1200
# Options of other programs, and of `./run test`.
FOREIGN = {"--long", "--full", "--build", "--preset", "--target", "--install", "--prefix", "--benchmark_repetitions",
           "--sample-accurate", "--repeat", "--gtest_filter", "--output-on-failure", "--no-install-recommends"}


def help_of(path):
    """Options and commands by `--help`; (None, []) for a command that another program answers, which may not be built."""
    result = subprocess.run([PROGRAM, *path, "--help"], capture_output=True, text=True)
    if result.returncode != 0 and path:
        return None, []
    text = result.stdout
    options = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text))
    listed = text.split("\nSubcommands:", 1)
    names = re.findall(r"^  ([a-z][\w-]*)\b", listed[1], re.M) if len(listed) > 1 else []
    return options, names


def command_tree(path=()):
    options, names = help_of(path)
    tree = {path: options}
    for name in names:
        tree.update(command_tree((*path, name)))
    return tree


def code_of(text):
    """Command lines in fenced blocks (continued lines joined), and inline code; without fences marked toml, json ..."""
    blocks = re.findall(r"^```(sh|text)?\n(.*?)^```", text, re.M | re.S)
    lines = [line for _, block in blocks for line in re.sub(r"\\\n\s*", " ", block).splitlines()]
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return lines, re.findall(r"`([^`\n]+)`", rest)


def check_command(code, tree, everything, where, faults):
    code = re.sub(r"\s#.*", "", code)
    called = re.match(r"(?:\./run|musicworld)\s+(.*)", code.strip())
    if not called:
        return
    words = called.group(1).split()
    if not words or words[0][0].isdigit() or words[0] in ("test", "ARGS...", "COMMAND", "...", "--version", "--help"):
        return
    path = ()
    for word in words:
        if (*path, word) not in tree:
            break
        path = (*path, word)
    if not path:
        faults.append(f"{where}: no command `{words[0]}` in: {code.strip()}")
        return
    if tree[path] is None:
        return
    for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", called.group(1)):
        if option not in tree[path] and not ("exec:" in code and option not in everything):
            faults.append(f"{where}: `{' '.join(path)}` has no {option}: {code.strip()}")


def check_page(page, tree, everything, faults):
    text = page.read_text(encoding="utf-8")
    where = str(page.relative_to(TOP))
    lines, inline = code_of(text)
    for code in lines + inline:
        check_command(code, tree, everything, where, faults)
    for code in inline:
        if code.startswith(("--", "`--")):
            for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", code):
                if None not in tree.values() and option not in everything | FOREIGN:
                    faults.append(f"{where}: no command has {option}")
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))):
        if re.match(r"[a-z]+:|#", target):
            continue
        if not (page.parent / target.split("#")[0]).exists():
            faults.append(f"{where}: link to {target}, which is not there")


def main():
    faults = []
    readme = (TOP / "README.md").read_text(encoding="utf-8")
    lines, words = len(readme.splitlines()), len(readme.split())
    if lines > MOST_LINES or words > MOST_WORDS:
        faults.append(f"README.md: found {lines} lines, {words} words, expected at most {MOST_LINES} and {MOST_WORDS}")
    tree = command_tree()
    everything = set().union(*filter(None, tree.values()))
    pages = [p for p in TOP.rglob("*.md") if not {"build", ".git"} & set(p.relative_to(TOP).parts)]
    for page in sorted(pages):
        check_page(page, tree, everything, faults)
    print("\n".join(faults))
    print(f"{len(pages)} pages, {len(tree) - 1} commands, {len(faults)} faults")
    return 1 if faults or len(tree) < 10 else 0


if __name__ == "__main__":
    sys.exit(main())
