#!/usr/bin/env python3
"""Photos of measured materials under three probes: the cells of the study (network fits of MERL) and a second, independent set (ABC fits).

Usage: photos.py network|abc --data DIR --make-merl make_merl.py --out DIR [--lookalike PROGRAM] [--size 128]

Writes OUT/MATERIAL-LIGHT.exr; existing photos are kept, so give each set and size a folder of its own. The networks'
mirror lobes vanish near grazing incidence, those of the ABC fits do not. Needs Python 3.10 and, for make_merl.py, numpy.
"""
import argparse
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# By the name of the light in the photo's name.
PROBES = {"Grace": "grace_cross.hdr", "Uffizi": "uffizi.hdr", "Eucalyptus": "rnl_cross.hdr"}
# The six materials of the paper's table that the set has, and others of every kind.
ABC = """aluminium blue-acrylic delrin nickel red-metallic-paint specular-red-phenolic gold-metallic-paint3 green-metallic-paint2 red-plastic
white-acrylic yellow-matte-plastic silver-metallic-paint black-phenolic ss440 hematite pink-fabric dark-blue-paint gray-plastic alumina-oxide gold-paint""".split()


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command}\n{done.stderr}")


def photo(options, source, material, light):
    """The photo of a material, made by `source` (a file, and for a collection `:NAME`), under a light."""
    exr = options.out / f"{material}-{light}.exr"
    if not exr.exists():
        table, part = options.out / f"{material}.binary", exr.with_suffix(".part.exr")
        if not table.exists():
            written = table.with_suffix(".part")
            run(sys.executable, options.make_merl, source, written)
            written.rename(table)
        env = options.data / "probes" / PROBES[light]
        run(options.lookalike, "render", "--brdf", table, "--env", env, "--size", options.size, "--samples", 1024, "--out", part)
        part.rename(exr)
    return exr


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", choices=["network", "abc"])
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--make-merl", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--size", type=int, default=128)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    folder = options.data / "materials"
    if options.set == "network":
        sources = {path.name.removesuffix(".nbrdf.json"): path for path in sorted(folder.glob("*.nbrdf.json"))}
    else:
        sources = {name: f"{folder / 'merl-abc.json'}:{name}" for name in ABC}
    for material, source in sources.items():
        for light in PROBES:
            print(photo(options, source, material, light), flush=True)


if __name__ == "__main__":
    main()
