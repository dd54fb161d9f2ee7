#!/usr/bin/env python3
"""CPU seconds of one fit by differentiable rendering beside those of this program, on the same photo and map, in one run.

    pip install mitsuba numpy
    experiments/adam.py PHOTO.exr MAP.hdr --lookalike PROGRAM [--samples 16] [--rate 0.03]

Mitsuba 3 renders the sphere (orthographic, inscribed in the photo) with its `principled` BSDF, and Adam changes base colour, roughness, specular
and metallic until the loss stays on a plateau: its mean over 40 iterations falls by less than 1 % against the 40 before. The loss is the mean
square difference of x^(1/2.2), so that highlights do not outweigh the rest. CPU seconds are of the whole process tree, user and system; those of
Mitsuba's imports and of reading the files are left out. Mitsuba needs an LLVM library, named by DRJIT_LIBLLVM_PATH: seen to work with LLVM 19, not
with 15 and AVX-512.
"""
import argparse
import pathlib
import resource
import subprocess
import tempfile
import time

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba_compare import scene_of

# After the import, which chooses another one.
mi.set_variant("llvm_ad_rgb")

WINDOW = 40
MOST = 2000


START = {
    "type": "principled",
    "base_color": {"type": "rgb", "value": [0.4, 0.4, 0.4]},
    "roughness": 0.3,
    "specular": 0.5,
    "metallic": 0.5,
}


def display(image):
    return dr.power(dr.maximum(image, 1e-4), 1 / 2.2)


def adam(photo, latlong, samples, rate):
    """Iterations, last mean of the loss, and the parameters."""
    object_ = scene_of(latlong, START, photo.shape[0], samples)
    parameters = mi.traverse(object_)
    names = [name for name in parameters.keys() if name.startswith("sphere.bsdf.")]
    names = [name for name in names if name.endswith(("base_color.value", "roughness.value", "specular", "metallic.value"))]
    optimiser = mi.ad.Adam(lr=rate)
    for name in names:
        optimiser[name] = parameters[name]
    parameters.update(optimiser)
    target = display(mi.TensorXf(photo))
    losses = []
    for step in range(MOST):
        image = mi.render(object_, parameters, seed=step)
        loss = dr.mean(dr.square(display(image) - target), axis=None)
        dr.backward(loss)
        optimiser.step()
        for name in names:
            optimiser[name] = dr.clip(optimiser[name], 0.001, 0.999)
        parameters.update(optimiser)
        losses.append(float(np.asarray(loss).ravel()[0]))
        if step % WINDOW == WINDOW - 1 and step >= 2 * WINDOW:
            now, before = np.mean(losses[-WINDOW:]), np.mean(losses[-2 * WINDOW:-WINDOW])
            if now > 0.99 * before:
                break
    return len(losses), np.mean(losses[-WINDOW:]), {name: np.asarray(parameters[name]).ravel() for name in names}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photo", type=pathlib.Path)
    parser.add_argument("map", type=pathlib.Path)
    parser.add_argument("--lookalike", type=pathlib.Path, required=True)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--rate", type=float, default=0.03)
    options = parser.parse_args()
    photo, latlong = (
        np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        for path in (options.photo, options.map)
    )
    began, wall = time.process_time(), time.perf_counter()
    count, loss, found = adam(photo, latlong, options.samples, options.rate)
    theirs, wall = time.process_time() - began, time.perf_counter() - wall
    print(f"Mitsuba {mi.__version__}, Adam: {count} iterations, {theirs:.1f} CPU s, {wall:.1f} s, loss {loss:.5f}")
    for name, value in found.items():
        print(f"  {name}: {np.array2string(value, precision=4)}")
    with tempfile.TemporaryDirectory() as out:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall = time.perf_counter()
        line = [options.lookalike, "fit", options.photo, "--env", options.map, "--model", "ggx", "--out", out + "/fit", "--progress", "none"]
        subprocess.run([str(part) for part in line], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wall = time.perf_counter() - wall
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    ours = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"lookalike fit: {ours:.1f} CPU s, {wall:.1f} s")
    print(f"ratio of CPU seconds: {theirs / ours:.1f}")


if __name__ == "__main__":
    main()
