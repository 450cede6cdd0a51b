#!/usr/bin/env python3
"""Compares what two builds of the program write: the same commands, file by file.

    compare_builds.py OLD_PROGRAM NEW_PROGRAM [--keep FOLDER]

Prints a line per command and file that differs, with the first differences, and a summary. What a clock or the machine decides is left out:
the keys of JSON named in CLOCKED, tables of times, and numbers in pages. Exit status 1 where anything differs.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

CLOCKED = {"stages_s", "realtime_factor", "wall_s", "elapsed_s", "cpu_s", "ns_per_body_step", "ns_per_sample", "versions", "version", "machine", "seconds"}
TIMED_TABLES = {"times.csv", "timing.csv", "workers.svg"}
LIVE = "latency"  # a run in real time: columns and keys alone

COMMANDS = {
    "play flourish": ["play", "flourish", "--fps", "10", "--size", "160x120", "--out", "@"],
    "play feints": ["play", "feints", "--no-frames", "--out", "@"],
    "play roll, thesis": ["play", "roll", "--no-frames", "--predictor", "thesis", "--out", "@"],
    "play feints, no cancelling, naive": ["play", "feints", "--no-frames", "--no-cancel", "--predictor", "naive", "--out", "@"],
    "play flourish, bells": ["play", "flourish", "--no-frames", "--kit", "bells", "--workers", "0", "--out", "@"],
    "play flourish, one note": ["play", "flourish", "--no-frames", "--solo", "3", "--out", "@"],
    "play roll, ca and bank": ["play", "roll", "--no-frames", "--picture-predictor", "ca", "--sound-predictor", "bank", "--out", "@"],
    "compare on the kit": ["compare", "flourish", "feints", "--no-cost", "--kit", "drums", "--rate", "60", "--noise", "0.25",
                           "--predictors", "auto,difference,cv", "--out", "@"],
    "compare on a plane": ["compare", "flourish", "roll", "--no-cost", "--plane", "contact+0.025", "--no-tuning",
                           "--predictors", "auto,hold,bank,imm", "--leads", "1/30,1/15", "--out", "@"],
    "predict": ["predict", "flourish", "--predictor", "auto", "--lead", "1/15", "--out", "@/rows.csv"],
    "predict, noisy": ["predict", "roll", "--predictor", "least-squares", "--lead", "1/30", "--rate", "60", "--noise", "1", "--seed", "3", "--out", "@/rows.csv"],
    "simulate lattice": ["simulate", "lattice", "--steps", "120", "--out", "@", "--frames", "--size", "160x120"],
    "simulate human": ["simulate", "human", "--steps", "120", "--out", "@"],
    "simulate spiked": ["simulate", "spiked", "--steps", "120", "--out", "@"],
    "simulate benchmark25": ["simulate", "benchmark25", "--steps", "200", "--out", "@", "--json"],
    "simulate benchmark100 on 2 workers": ["simulate", "benchmark100", "--steps", "60", "--workers", "2", "--out", "@"],
    "modes of a box": ["modes", "--size", "1,2,3", "--young", "1", "--poisson", "0.3", "--density", "1", "--elements", "2", "--json"],
    "modes of an ellipsoid": ["modes", "--shape", "ellipsoid", "--size", "1,1,2", "--young", "1e6", "--poisson", "0.3", "--density", "1000", "--count", "12"],
    "kit list": ["kit", "list"],
    "kit show": ["kit", "show", "drums"],
    "kit check": ["kit", "check", "bells"],
    "kit draw": ["kit", "draw", "drums", "--out", "@/kit.png"],
    "trace info": ["trace", "info", "flourish"],
    "trace synth": ["trace", "synth", "roll", "--seed", "4", "--out", "@/roll.csv"],
    "trace convert": ["trace", "convert", "@old_roll", "--resample", "60", "--noise", "0.5", "--jitter", "3", "--drop-out", "0.1", "--seed", "7", "--out", "@/t.csv"],
    LIVE: ["latency", "--seconds", "3", "--json", "--out", "@"],
}


def clean(value, numbers):
    if isinstance(value, dict):
        return {k: clean(v, numbers) for k, v in value.items() if k not in CLOCKED}
    if isinstance(value, list):
        return sorted({json.dumps(clean(v, numbers)) for v in value}) if not numbers else [clean(v, numbers) for v in value]
    return value if numbers else type(value).__name__


def as_json(text):
    try:
        return json.loads(text)
    except ValueError:
        return None


def content(name, data, live):
    """What is compared of a file."""
    path = pathlib.Path(name)
    if path.name in TIMED_TABLES or (live and path.suffix not in (".json", ".csv")):
        return "present"
    text = None
    try:
        text = data.decode()
    except UnicodeDecodeError:
        return data if not live else "present"
    parsed = as_json(text) if path.suffix in (".json", "") else None
    if parsed is not None:
        return json.dumps(clean(parsed, not live), indent=1, sort_keys=True)
    if live:
        return text.split("\n", 1)[0]
    if path.suffix == ".html":
        return re.sub(r"[-+]?\d[\d.e+-]*", "#", text)
    return text


def differences(a, b):
    if isinstance(a, bytes) or isinstance(b, bytes):
        return ["bytes differ"]
    old, new = a.split("\n"), b.split("\n")
    rows = [f"-{x[:150]} | +{y[:150]}" for x, y in zip(old, new) if x != y]
    if len(old) != len(new):
        rows.append(f"{len(old)} lines, now {len(new)}")
    return rows


def run(program, command, folder, traces):
    folder.mkdir(parents=True)
    words = [str(traces / "roll.csv") if w == "@old_roll" else w.replace("@", str(folder)) for w in command]
    ended = subprocess.run([program] + words, capture_output=True, stdin=subprocess.DEVNULL, check=False)
    printed = ended.stdout
    files = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    files["(standard output)"] = re.sub(rb"\d+(\.\d+)? (m?s\b|us\b|times real time)", rb"#", printed)
    files["(status)"] = str(ended.returncode).encode()
    replaced = {str(folder).encode(): b"@", str(pathlib.Path(program).resolve().parents[3]).encode(): b"CHECKOUT"}
    for found, word in replaced.items():
        files = {name: data.replace(found, word) for name, data in files.items()}
    return files


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    assets = pathlib.Path(__file__).resolve().parent.parent / "assets" / "traces"
    with tempfile.TemporaryDirectory() as scratch:
        top = arguments.keep or pathlib.Path(scratch)
        equal = different = 0
        for name, command in COMMANDS.items():
            folder = top / re.sub(r"\W+", "_", name)
            old = run(arguments.old, command, folder / "old", assets)
            new = run(arguments.new, command, folder / "new", assets)
            live = name == LIVE
            for file in sorted(old.keys() | new.keys()):
                if file not in old or file not in new:
                    rows = ["only " + ("old" if file in old else "new")]
                else:
                    a, b = content(file, old[file], live), content(file, new[file], live)
                    rows = [] if a == b else differences(a, b)
                equal += not rows
                different += bool(rows)
                if rows:
                    print(f"{name}: {file}: " + "\n    ".join(rows[:3]) + (f"\n    ... {len(rows)} in all" if len(rows) > 3 else ""))
        print(f"{equal} files equal, {different} different, {len(COMMANDS)} commands")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
