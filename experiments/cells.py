#!/usr/bin/env python3
"""The polished scores of the study's 30 cells, by the present program and as docs/results.md and docs/results-ggx-f90.md have them.

Usage: cells.py --data DIR --photos DIR [--lookalike PROGRAM]

Fits each photo that `photos.py network` wrote with ggx, f90 held at 1 and free, and prints the differences of the polished CSSIM. The photos
have other noise than the study's. Needs Python 3.10.
"""
import argparse
import csv
import json
import pathlib
import tempfile

from photos import PROBES, ROOT, run

LIGHTS = {"Grace Cathedral": "Grace", "Uffizi Gallery": "Uffizi", "Eucalyptus Grove": "Eucalyptus"}
# The study's names of the model, where its scores are, and the flags of the nearest model today.
STORED = {"ggx": ("results", ["--fix", "f90=1"]), "ggx-f90": ("results-ggx-f90", [])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--photos", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    options = parser.parse_args()
    differences = {model: [] for model in STORED}
    print("| material | light | " + " | ".join(f"{model}, stored | now | difference" for model in STORED) + " |")
    print("|---|---|" + "---|" * 3 * len(STORED))
    stored = {}
    for model, (folder, _) in STORED.items():
        with open(ROOT / "docs" / folder / "figures-cells.csv", newline="") as file:
            for row in csv.DictReader(file):
                if row["light"] in LIGHTS and " of " not in row["material"]:
                    stored.setdefault((row["material"], row["light"]), {})[model] = float(row["ours + polish"])
    folder = tempfile.TemporaryDirectory()
    out = pathlib.Path(folder.name)
    for (material, light), before in stored.items():
        line = f"| {material} | {light} |"
        for model, (_, flags) in STORED.items():
            env = options.data / "probes" / PROBES[LIGHTS[light]]
            run(options.lookalike, "fit", options.photos / f"{material}-{LIGHTS[light]}.exr", "--env", env, "--model", "ggx", *flags, "--out", out, "--force", "--progress", "none")
            now = json.loads((out / "fit.json").read_text())["polished"]["cssim"]
            differences[model].append(now - before[model])
            line += f" {before[model]:.4f} | {now:.4f} | {now - before[model]:+.4f} |"
        print(line, flush=True)
    for model, changes in differences.items():
        print(f"{model}: {len(changes)} cells, mean {sum(changes) / len(changes):+.5f}, worst {max(changes):+.4f}, best {min(changes):+.4f}")


if __name__ == "__main__":
    main()
