#!/usr/bin/env python3
"""Makes docs/images/materials.png, the picture of the README: photo, match and difference of a metal, a plastic and a paint.

    pip install numpy pillow
    cargo build --release --bin lookalike
    experiments/readme_picture.py [--data DIR] [--make-merl make_merl.py] [--lookalike PROGRAM] [--work DIR]

The photos are renderings of network fits of MERL measurements (Sztrajman et al. 2021) under two CC0 maps of Poly Haven, 192 x 192
pixels, by `lookalike render --brdf`. Each is fitted by `lookalike fit` with 256 samples and seed 0. The difference
is the absolute difference of the two displayed images, four times as bright. DIR holds probes/ and materials/; the default is
LOOKALIKE_DATA, else ../shared/data beside the checkout; make_merl.py is looked for in DIR/../tools. Photos and fits that are in the
work folder already are kept. About 10 minutes on two cores.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parent.parent
MATERIALS = [("aluminium", "metal"), ("specular-red-phenolic", "plastic"), ("gold-metallic-paint3", "paint")]
LIGHTS = [("studio_small_05_1k", "Studio Small 05"), ("noon_grass_1k", "Noon Grass")]
MODEL = "ggx"
# Columns and rows of the photos, and samples per pixel.
SIZE, SAMPLES = 192, 1024
BRIGHTER = 4

# Of the sheet, in pixels.
PANEL, GAP, LEFT, TOP, BETWEEN = 122, 4, 92, 50, 14
BACKGROUND, BRIGHT, SOFT = (0, 0, 0), (236, 238, 242), (158, 164, 174)


def run(command):
    """Standard error of a command that has to succeed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stderr


def fit(options, material, light):
    """Folder of a finished fit."""
    out = options.work / f"{material}-{light}"
    if (out / "fit.json").exists():
        return out
    photo = options.work / f"{material}-{light}.exr"
    env = ["--env", options.data / f"probes/{light}.hdr"]
    if not photo.exists():
        table = options.work / f"{material}.binary"
        if not table.exists():
            run([sys.executable, options.make_merl, options.data / f"materials/{material}.nbrdf.json", table])
        partial = photo.with_suffix(".part.exr")
        said = run([options.lookalike, "render", "--brdf", table, *env, "--size", SIZE, "--samples", SAMPLES, "-o", partial])
        print(photo.stem, *re.findall(r"noise:.*", said), flush=True)
        partial.rename(photo)
    method = ["--model", MODEL, "--samples", 256, "--seed", 0]
    run([options.lookalike, "fit", photo, *env, *method, "--out", out, "--progress", "none"])
    return out


def panels(folder):
    """Photo, match and difference as displayed, reduced to the size of a panel."""
    shown = [np.array(Image.open(folder / name).convert("RGB"), float) for name in ("reference.png", "match.png")]
    shown.append(np.clip(BRIGHTER * np.abs(shown[0] - shown[1]), 0, 255))
    images = [Image.fromarray(np.round(pixels).astype(np.uint8)) for pixels in shown]
    return [image.resize((PANEL, PANEL), Image.Resampling.LANCZOS) for image in images]


def sheet(rows):
    """Rows of (name, kind, [(score, panels) per light])."""
    group = 3 * PANEL + 2 * GAP
    caption = 20
    width = LEFT + len(LIGHTS) * group + (len(LIGHTS) - 1) * BETWEEN + GAP
    height = TOP + len(rows) * (PANEL + caption) + GAP
    image = Image.new("RGB", (width, height), BACKGROUND)
    draw = ImageDraw.Draw(image)
    large, small = ImageFont.load_default(15), ImageFont.load_default(12)
    for column, (_, light) in enumerate(LIGHTS):
        x = LEFT + column * (group + BETWEEN)
        draw.text((x + group / 2, 14), light, BRIGHT, large, anchor="mm")
        for k, word in enumerate(["photo", "match", f"difference x {BRIGHTER}"]):
            draw.text((x + k * (PANEL + GAP) + PANEL / 2, 38), word, SOFT, small, anchor="mm")
    for row, (name, kind, cells) in enumerate(rows):
        y = TOP + row * (PANEL + caption)
        draw.text((10, y + PANEL / 2 - 24), kind, BRIGHT, large, anchor="lm")
        for line, word in enumerate(name.split("-")):
            draw.text((10, y + PANEL / 2 - 4 + 16 * line), word, SOFT, small, anchor="lm")
        for column, (score, images) in enumerate(cells):
            x = LEFT + column * (group + BETWEEN)
            for k, panel in enumerate(images):
                image.paste(panel, (x + k * (PANEL + GAP), y))
            draw.text((x + PANEL + GAP + PANEL / 2, y + PANEL + 9), f"CSSIM {score:.3f}", SOFT, small, anchor="mm")
    return image


def main():
    data = pathlib.Path(os.environ.get("LOOKALIKE_DATA", ROOT / "../shared/data"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, default=data)
    parser.add_argument("--make-merl", type=pathlib.Path)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/readme-picture")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/images/materials.png")
    options = parser.parse_args()
    options.make_merl = options.make_merl or options.data / "../tools/make_merl.py"
    options.work.mkdir(parents=True, exist_ok=True)
    rows = []
    for material, kind in MATERIALS:
        cells = []
        for light, _ in LIGHTS:
            folder = fit(options, material, light)
            score = json.loads((folder / "fit.json").read_text())["polished"]["cssim"]
            print(f"{material}, {light}: CSSIM {score:.4f}", flush=True)
            cells.append((score, panels(folder)))
        rows.append((material, kind, cells))
    sheet(rows).save(options.out, optimize=True)
    print(f"{options.out}: {options.out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
