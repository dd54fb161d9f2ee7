#!/usr/bin/env python3
"""What the 21 gammas are worth: scores of fits with one gamma, with the default ones and with a wider range, with and without polish.

Usage: gammas.py --data DIR --photos DIR [--lookalike PROGRAM]

The photos are those that cells.py renders (its folder --work). Prints the means over them, and the largest difference from the default.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROBES = {"Grace": "grace_cross.hdr", "Uffizi": "uffizi.hdr", "Eucalyptus": "rnl_cross.hdr"}
RANGES = {"2.2": "2.2", "1 to 3 (default)": "1:3:0.1", "0.5 to 6": "0.5:6:0.1"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--photos", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    options = parser.parse_args()
    photos = sorted(path for path in options.photos.glob("*-*.exr") if ".part" not in path.name)
    if not photos:
        sys.exit(f"no photos in {options.photos}: run cells.py --work {options.photos} first")
    scores = {name: {"without polish": [], "with polish": []} for name in RANGES}
    with tempfile.TemporaryDirectory() as out:
        for photo in photos:
            env = options.data / "probes" / PROBES[photo.stem.rsplit("-", 1)[1]]
            for name, gammas in RANGES.items():
                command = [options.lookalike, "fit", photo, "--env", env, "--gammas", gammas, "--out", out, "--force", "--progress", "none"]
                subprocess.run([str(part) for part in command], check=True, capture_output=True)
                fit = json.loads((pathlib.Path(out) / "fit.json").read_text())
                scores[name]["without polish"].append(fit["stage_two"]["cssim"])
                scores[name]["with polish"].append(fit["polished"]["cssim"])
    print("| gammas | without polish | most below the default | with polish | most below the default |\n|---|---|---|---|---|")
    for name, of in scores.items():
        line = f"| {name} |"
        for kind, values in of.items():
            gain = max(default - value for default, value in zip(scores["1 to 3 (default)"][kind], values))
            line += f" {sum(values) / len(values):.4f} | {gain:.4f} |"
        print(line)


if __name__ == "__main__":
    main()
