#!/usr/bin/env python3
"""The polished scores of the study's 30 cells, by the present program and as docs/results.md and docs/results-ggx-f90.md have them.

Usage: cells.py --data DIR --make-merl make_merl.py [--lookalike PROGRAM] [--work DIR]

Renders the ten materials under the three probes as the study does (existing photos are kept), fits each with ggx, f90 held at 1 and free, and prints the
differences of the polished CSSIM. The photos have other noise than the study's. Needs Python 3.10 and, for make_merl.py, numpy.
"""
import argparse
import csv
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROBES = {"Grace Cathedral": "grace_cross.hdr", "Uffizi Gallery": "uffizi.hdr", "Eucalyptus Grove": "rnl_cross.hdr"}
# The study's names of the model, where its scores are, and the flags of the same model today.
STORED = {"ggx": ("results", ["--fix", "f90=1"]), "ggx-f90": ("results-ggx-f90", [])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--make-merl", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("cells"))
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)

    def run(*command):
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{command}\n{done.stderr}")

    def photo(material, light):
        exr = options.work / f"{material}-{light.split()[0]}.exr"
        if not exr.exists():
            table, part = options.work / f"{material}.binary", exr.with_suffix(".part.exr")
            if not table.exists():
                written = table.with_suffix(".part")
                run(sys.executable, options.make_merl, options.data / f"materials/{material}.nbrdf.json", written)
                written.rename(table)
            env = options.data / "probes" / PROBES[light]
            run(options.lookalike, "render", "--brdf", table, "--env", env, "--size", 128, "--samples", 1024, "--out", part)
            part.rename(exr)
        return exr

    differences = {model: [] for model in STORED}
    print("| material | light | " + " | ".join(f"{model}, stored | now | difference" for model in STORED) + " |")
    print("|---|---|" + "---|" * 3 * len(STORED))
    stored = {}
    for model, (folder, _) in STORED.items():
        with open(ROOT / "docs" / folder / "figures-cells.csv", newline="") as file:
            for row in csv.DictReader(file):
                if row["light"] in PROBES and " of " not in row["material"]:
                    stored.setdefault((row["material"], row["light"]), {})[model] = float(row["ours + polish"])
    for (material, light), before in stored.items():
        line = f"| {material} | {light} |"
        for model, (_, flags) in STORED.items():
            out = options.work / "fit"
            env = options.data / "probes" / PROBES[light]
            run(options.lookalike, "fit", photo(material, light), "--env", env, "--model", "ggx", *flags, "--out", out, "--force", "--progress", "none")
            now = json.loads((out / "fit.json").read_text())["polished"]["cssim"]
            differences[model].append(now - before[model])
            line += f" {before[model]:.4f} | {now:.4f} | {now - before[model]:+.4f} |"
        print(line, flush=True)
    for model, changes in differences.items():
        print(f"{model}: {len(changes)} cells, mean {sum(changes) / len(changes):+.5f}, worst {max(changes):+.4f}, best {min(changes):+.4f}")


if __name__ == "__main__":
    main()
