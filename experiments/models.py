#!/usr/bin/env python3
"""The scores of models, of `--model auto`, and of each under the lights that it was not fitted to.

Usage: models.py --data DIR --photos DIR --out DIR [--models MODEL..] [--held-out] [--lookalike PROGRAM]

Fits every photo that `photos.py` wrote with each model (a name, with `;FLAG=VALUE` for further flags, such as `ggx;--fix=f90=1`), and prints
the polished CSSIM, and the model that auto chose. With --held-out, each result is rendered under the other two lights and compared with the
photos there, at the display exposure of those photos. Fits are kept in OUT. Needs Python 3.10.
"""
import argparse
import json
import pathlib
import statistics

from photos import PROBES, ROOT, run
import subprocess

MODELS = ["ggx;--fix=f90=1", "ggx", "ggx-haze", "cook-torrance", "auto"]


def fitted(options, photo, light, model):
    """The fit.json of a photo and a model."""
    out = options.out / f"{photo.stem}-{model.replace(';', '_').replace('--', '')}"
    if not (out / "fit.json").exists():
        name, *flags = model.split(";")
        env = options.data / "probes" / PROBES[light]
        run(options.lookalike, "fit", photo, "--env", env, "--model", name, *flags, "--out", out, "--force", "--progress", "none")
    return json.loads((out / "fit.json").read_text())


def params(fit):
    last = (fit["polished"] or fit["stage_two"])["parameters"]
    text = lambda value: ",".join(map(str, value)) if isinstance(value, list) else str(value)
    return ",".join(f"{name}={text(value)}" for name, value in last.items())


def relit(options, fit, photo, light):
    """CSSIM of the fitted material under another light, against the photo there."""
    image = options.out / "relit.exr"
    env = options.data / "probes" / PROBES[light]
    size = json.loads(json.dumps(fit["geometry"]))["width"]
    run(options.lookalike, "render", "--model", fit["model"], "--params", params(fit), "--env", env, "--size", size, "--samples", 256, "--out", image)
    exposure = fitted(options, photo, light, options.models[0])["display_exposure"]
    done = subprocess.run([options.lookalike, "compare", photo, image, "--display-exposure", str(exposure), "--json"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["score"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--photos", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--models", nargs="+", default=MODELS)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    scores = {model: [] for model in options.models}
    outside = {model: [] for model in options.models}
    print("| photo | " + " | ".join(options.models) + " | chosen by auto |")
    for photo in sorted(options.photos.glob("*-*.exr")):
        material, light = photo.stem.rsplit("-", 1)
        if light not in PROBES:
            continue
        line, chosen = f"| {photo.stem} |", ""
        for model in options.models:
            fit = fitted(options, photo, light, model)
            scores[model].append((fit["polished"] or fit["stage_two"])["cssim"])
            line += f" {scores[model][-1]:.4f} |"
            if len(fit["models"]) > 1:
                tried = [f"{m['cssim']:.4f}:{m['above_best']['difference']:.4f}+-{m['above_best']['standard_error']:.4f}{'*' if m['chosen'] else ''}" for m in fit["models"]]
                chosen = " ".join(tried)
            if options.held_out:
                for other in PROBES:
                    elsewhere = options.photos / f"{material}-{other}.exr"
                    if other != light and elsewhere.exists():
                        outside[model].append(relit(options, fit, elsewhere, other))
        print(line, chosen, "|", flush=True)
    for model in options.models:
        text = f"{model}: {len(scores[model])} photos, mean {statistics.mean(scores[model]):.4f}, median {statistics.median(scores[model]):.4f}"
        if outside[model]:
            text += f"; under other lights {len(outside[model])} pictures, mean {statistics.mean(outside[model]):.4f}, median {statistics.median(outside[model]):.4f}"
        print(text)


if __name__ == "__main__":
    main()
