#!/usr/bin/env python3
"""Whether `--model auto` returns the simple model for photos of it: ggx with f90 = 1 (metals, plastics, rough surfaces), with noise.

Usage: simple.py --data DIR --out DIR [--noise .01] [--seeds 3] [--lookalike PROGRAM]

Renders the materials under three probes, adds Gaussian noise in proportion to the radiance, fits, and prints the chosen model and how far its
parameters are from the truth. Needs Python 3.10, numpy and OpenEXR (pip install numpy OpenEXR).
"""
import argparse
import json
import pathlib

import numpy
import OpenEXR

from photos import PROBES, ROOT, run

MATERIALS = {
    "gold": ("0,0,0", ".9,.6,.3", .15),
    "steel": ("0,0,0", ".55,.53,.5", .3),
    "plastic": (".4,.15,.08", ".04,.04,.04", .08),
    "blue": (".05,.08,.3", ".05,.05,.05", .2),
    "rough": (".3,.25,.2", ".06,.06,.05", .45),
    "clay": (".45,.3,.2", ".04,.04,.04", .7),
}


def noisy(source, target, noise, seed):
    with OpenEXR.File(str(source)) as file:
        pixels = file.channels()["RGB"].pixels if "RGB" in file.channels() else file.channels()["RGBA"].pixels[..., :3]
    pixels = pixels.astype(numpy.float32)
    pixels = pixels * (1 + noise * numpy.random.default_rng(seed).standard_normal(pixels.shape)).astype(numpy.float32)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": pixels.astype(numpy.float32)}).write(str(target))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--noise", type=float, default=.01)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    simple = count = 0
    for name, (kd, f0, alpha) in MATERIALS.items():
        for light, probe in PROBES.items():
            env = options.data / "probes" / probe
            clean = options.out / f"{name}-{light}.exr"
            if not clean.exists():
                params = f"kd={kd},f0={f0},f90=1,alpha={alpha}"
                run(options.lookalike, "render", "--model", "ggx", "--params", params, "--env", env, "--size", options.size, "--samples", 1024, "--out", clean)
            for seed in range(options.seeds):
                photo, out = options.out / f"{name}-{light}-{seed}.exr", options.out / f"fit-{name}-{light}-{seed}"
                noisy(clean, photo, options.noise, seed)
                run(options.lookalike, "fit", photo, "--env", env, "--out", out, "--force", "--progress", "none")
                fit = json.loads((out / "fit.json").read_text())
                tried = " ".join(f"{m['cssim']:.5f}:{m['above_best']['difference']:.5f}+-{m['above_best']['standard_error']:.5f}{'*' if m['chosen'] else ''}" for m in fit["models"])
                is_simple = fit["model"] == "ggx" and fit["fixed"] == {"f90": 1.0}
                simple, count = simple + is_simple, count + 1
                print(f"{name} {light} {seed}: {fit['model']} {fit['fixed']} alpha {fit['polished']['parameters']['alpha'] / alpha:.3f} of the truth; {tried}", flush=True)
    print(f"{simple} of {count} photos have the simple model")


if __name__ == "__main__":
    main()
