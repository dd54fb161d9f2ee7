#!/usr/bin/env python3
"""Compares a rendering of this project with one by Mitsuba 3: the same sphere, map and reflectance.

    pip install mitsuba numpy
    cargo build --release -p lookalike --example render_sphere
    experiments/mitsuba_compare.py MAP.hdr --out DIR [--size 128] [--samples 1024]

For a diffuse sphere and for GGX at F = 1 (Mitsuba: `roughconductor`, material `none`) it prints the relative root mean
square difference over the sphere beside Mitsuba's own noise, the ratio of the means per channel, and the same difference
after every flip and quarter turn, where the unturned image must agree best. PNGs of both and of their difference go to DIR.

Two conventions differ, and are resolved here:
- Mitsuba puts the centres of the first and last row of a map on the poles, this project half a texel inside. The map is
  resampled to 2 H + 1 rows, on which Mitsuba's bilinear function is exactly this project's.
- Mitsuba masks by G1(l) G1(v); `ggx` has height-correlated Smith. `separable` renders Mitsuba's; the difference of the
  two is printed as well.
"""

import argparse
import pathlib
import subprocess

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

SURFACES = [("diffuse", 0.5), ("separable", 0.05), ("separable", 0.3), ("correlated", 0.05), ("correlated", 0.3)]


def rows_on_poles(latlong):
    """The bilinear function of H rows at (i + 1/2) / H, on 2 H + 1 rows at i / (2 H)."""
    height, width, _ = latlong.shape
    beyond = np.roll(latlong, width // 2, axis=1)
    padded = np.concatenate([beyond[:1], latlong, beyond[-1:]])
    out = np.empty((2 * height + 1, width, 3), np.float32)
    out[1::2] = latlong
    out[0::2] = 0.5 * (padded[:-1] + padded[1:])
    return out


def bsdf(kind, value):
    if kind == "diffuse":
        return {"type": "diffuse", "reflectance": {"type": "rgb", "value": [value] * 3}}
    return {"type": "roughconductor", "distribution": "ggx", "alpha": value, "material": "none"}


def scene_of(latlong, reflectance, size, samples):
    """A sphere under a map, seen along parallel rays that it fills."""
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True},
        "light": {"type": "envmap", "bitmap": mi.Bitmap(rows_on_poles(latlong))},
        "sphere": {"type": "sphere", "bsdf": reflectance},
        "sensor": {
            "type": "orthographic",
            "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent", "sample_count": samples},
        },
    })


def mitsuba_image(latlong, kind, value, size, samples, seed):
    return np.array(mi.render(scene_of(latlong, bsdf(kind, value), size, samples), seed=seed))[..., :3]


def our_image(program, map_path, out, size, samples, kind, value):
    image, latlong = out / "ours.exr", out / "map.exr"
    subprocess.run([program, map_path, image, latlong, str(size), str(samples), kind, str(value)], check=True)
    return tuple(np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB)) for path in (image, latlong))


def write_png(path, image, exposure):
    mi.Bitmap((image * exposure).astype(np.float32)).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True).write(str(path))


def relative_rms(a, b, inside):
    return np.sqrt(np.mean((a - b)[inside] ** 2)) / np.mean(b[inside])


def block_means(image, inside, side=8):
    """Means over the blocks of side x side pixels that lie wholly on the sphere: the noise falls by `side`."""
    count = image.shape[0] // side
    split = image[:count * side, :count * side].reshape(count, side, count, side, 3).mean(axis=(1, 3))
    whole = inside[:count * side, :count * side].reshape(count, side, count, side).all(axis=(1, 3))
    return split[whole]


def orientations(image):
    for turns in range(4):
        turned = np.rot90(image, turns)
        yield f"turned {90 * turns}", turned
        yield f"turned {90 * turns} and mirrored", turned[:, ::-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--program", default=pathlib.Path(__file__).resolve().parent.parent / "target/release/examples/render_sphere")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=1024)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    size = arguments.size
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size * 2 - 1] * 2)
    inside = np.hypot(x, y) < 1 - 2.0 / size
    for kind, value in SURFACES:
        ours, latlong = our_image(arguments.program, arguments.map, arguments.out, size, 4 * arguments.samples, kind, value)
        # Two independent halves give Mitsuba's own noise.
        halves = [mitsuba_image(latlong, kind, value, size, arguments.samples // 2, seed) for seed in (1, 2)]
        theirs = 0.5 * (halves[0] + halves[1])
        noise = 0.5 * relative_rms(halves[0], halves[1], inside)
        ratio = ours[inside].mean(axis=0) / theirs[inside].mean(axis=0)
        blocks = [block_means(image, inside) for image in (ours, theirs, *halves)]
        everything = np.ones(len(blocks[0]), bool)
        coarse = relative_rms(blocks[0], blocks[1], everything)
        coarse_noise = 0.5 * relative_rms(blocks[2], blocks[3], everything)
        print(f"{kind} {value}: relative RMS {100 * relative_rms(ours, theirs, inside):.2f} %, Mitsuba's noise {100 * noise:.2f} %, "
              f"means ours / Mitsuba {ratio.round(5)}")
        print(f"    over blocks of 8 x 8 pixels {100 * coarse:.2f} %, noise {100 * coarse_noise:.2f} %")
        others = {name: relative_rms(image, theirs, inside) for name, image in orientations(ours)}
        best = min(others, key=others.get)
        runner_up = sorted(others.values())[1]
        print(f"    best orientation: {best}; the next best is {100 * runner_up:.0f} % off")
        exposure = 0.7 / np.percentile(theirs[inside], 97)
        name = f"{kind}_{value}"
        write_png(arguments.out / f"{name}_ours.png", ours, exposure)
        write_png(arguments.out / f"{name}_mitsuba.png", theirs, exposure)
        write_png(arguments.out / f"{name}_difference_x10.png", 10 * np.abs(ours - theirs), exposure)
        if best != "turned 0":
            raise SystemExit(f"{kind} {value}: the images agree only when {best}")


if __name__ == "__main__":
    main()
