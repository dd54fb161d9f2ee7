#!/usr/bin/env python3
"""Mean scores of fits of the same photos with different flags.

Usage: variants.py --data DIR --photos DIR [--lookalike PROGRAM] [--seeds 1] "NAME=FLAGS" "NAME=FLAGS" ...

The photos are those of photos.py. The table has the mean CSSIM without and with polish, and the most that a fit is better (lower) and worse
than the one of the first variant. FLAGS may be empty.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from photos import PROBES, ROOT


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--photos", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("variants", nargs="+", metavar="NAME=FLAGS")
    options = parser.parse_args()
    photos = sorted(path for path in options.photos.glob("*-*.exr") if ".part" not in path.name)
    if not photos:
        sys.exit(f"no photos in {options.photos}: run photos.py first")
    variants = dict(variant.split("=", 1) for variant in options.variants)
    scores = {name: ([], []) for name in variants}
    with tempfile.TemporaryDirectory() as out:
        for photo in photos:
            env = options.data / "probes" / PROBES[photo.stem.rsplit("-", 1)[1]]
            for seed in range(options.seeds):
                for name, flags in variants.items():
                    command = [options.lookalike, "fit", photo, "--env", env, "--out", out, "--force", "--progress", "none", "--seed", seed]
                    subprocess.run([str(part) for part in command] + flags.split(), check=True, capture_output=True)
                    fit = json.loads((pathlib.Path(out) / "fit.json").read_text())
                    scores[name][0].append(fit["stage_two"]["cssim"])
                    scores[name][1].append(fit["polished"]["cssim"] if fit["polished"] else float("nan"))
    first = next(iter(scores.values()))
    print(f"{len(photos)} photos, {options.seeds} seeds\n")
    print("| variant | without polish | better | worse | with polish | better | worse |\n|---|---|---|---|---|---|---|")
    for name, of in scores.items():
        line = f"| {name} |"
        for values, before in zip(of, first):
            changes = [value - old for value, old in zip(values, before)]
            if any(value != value for value in values):
                line += " - | - | - |"
                continue
            line += f" {sum(values) / len(values):.4f} | {max(0, -min(changes)):.4f} | {max(0, *changes):.4f} |"
        print(line)


if __name__ == "__main__":
    main()
