#!/usr/bin/env python3
"""Whether the stated 95 % ranges hold the truth: synthetic photos of known materials, metals to plastics, three probes, noise of .2 to 2 %.

Usage: calibration.py --data DIR --out DIR [--photos 200] [--size 128] [--lookalike PROGRAM] [--model auto]

Draws materials of ggx with f90 = 1, renders and fits them, and prints for each kind of parameter and each noise in how many cases the range held
the truth, and half its width as a share of the value. A photo's files are kept, so a second call only fits again. Needs Python 3.10, numpy and
OpenEXR (pip install numpy OpenEXR).
"""
import argparse
import json
import pathlib
import statistics

import numpy

from photos import PROBES, ROOT, run
from simple import noisy

NOISE = [.002, .005, .01, .02]


def material(random):
    alpha = float(numpy.exp(random.uniform(numpy.log(.03), numpy.log(.6))))
    if random.random() < .5:
        kd, f0 = [0.0] * 3, random.uniform(.35, .95, 3).tolist()
    else:
        kd, f0 = random.uniform(.03, .6, 3).tolist(), [float(random.uniform(.03, .08))] * 3
    return {"kd": [round(x, 4) for x in kd], "f0": [round(x, 4) for x in f0], "f90": 1.0, "alpha": round(alpha, 5)}


def as_list(value):
    return value if isinstance(value, list) else [value]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--photos", type=int, default=200)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--model", default="auto")
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    random = numpy.random.default_rng(7)
    lights = list(PROBES.values())
    # (parameter, noise, light) -> whether the range held the truth, half its width over the value, state
    rows = []
    for n in range(options.photos):
        truth, probe, noise = material(random), lights[n % 3], NOISE[n // 3 % 4]
        clean, photo, out = (options.out / name for name in (f"{n}-clean.exr", f"{n}.exr", f"fit-{n}"))
        env = options.data / "probes" / probe
        if not photo.exists():
            params = ",".join(f"{name}=" + ",".join(map(str, as_list(value))) for name, value in truth.items())
            run(options.lookalike, "render", "--model", "ggx", "--params", params, "--env", env, "--size", options.size, "--samples", 1024, "--out", clean)
            noisy(clean, photo, noise, n)
        run(options.lookalike, "fit", photo, "--env", env, "--model", options.model, "--out", out, "--force", "--progress", "none")
        fit = json.loads((out / "fit.json").read_text())
        known, found = fit["uncertainty"], fit["polished"]["parameters"]
        for name, true in truth.items():
            for low, high, state, value, true in zip(*map(as_list, (known["low"][name], known["high"][name], known["state"][name], found[name], true))):
                if state != "held":
                    rows.append((name, noise, probe, low <= true <= high, (high - low) / 2 / max(abs(true), .01), state))
                    if not low <= true <= high:
                        print(f"photo {n} ({probe}, noise {noise}, {truth}): {name} {value:.4f}, {low:.4f} to {high:.4f} ({state})", flush=True)
        if n % 20 == 19:
            print(f"{n + 1} photos: {sum(row[3] for row in rows)} of {len(rows)} ranges hold the truth", flush=True)
    for title, index in (("parameter", 0), ("noise", 1), ("light", 2), ("state", 5)):
        for key in sorted({row[index] for row in rows}, key=str):
            of = [row for row in rows if row[index] == key]
            print(f"{title} {key}: {100 * sum(row[3] for row in of) / len(of):.1f} % of {len(of)}, half width {statistics.median(row[4] for row in of):.3f} of the value")
    print(f"all: {100 * sum(row[3] for row in rows) / len(rows):.1f} % of {len(rows)}")


if __name__ == "__main__":
    main()
