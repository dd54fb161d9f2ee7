#!/usr/bin/env python3
"""CPU seconds, wall seconds, memory and score of whole fits with two programs in turn (A B A B ...), as a table in Markdown.

Usage: speed.py --before PROGRAM --after PROGRAM --data DIR [--runs 3] [--works demo,256,...]

DIR holds the light probes in `probes/`. Photos are rendered by the program AFTER, so both fit the same files. CPU seconds are of the
whole process tree, user and system; memory is the largest resident set of any process. The table has medians over the runs. Needs Python
3.10 and an otherwise idle machine.
"""
import argparse
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

GGX = ["--model", "ggx"]
# By name: what it is, parameters of the photo (`ggx`), side in pixels, probe, flags of the fit.
PHOTOS = {
    "256": ("256 px, alpha .1", "kd=.4,.15,.08,f0=.05,alpha=.1", 256, "uffizi.hdr", GGX),
    "256 auto": ("the same, auto", "kd=.4,.15,.08,f0=.05,alpha=.1", 256, "uffizi.hdr", []),
    "128 sharp": ("128 px, alpha .02", "kd=.02,f0=.9,alpha=.02", 128, "uffizi.hdr", GGX),
    "cook-torrance": ("the same, cook-torrance", "kd=.02,f0=.9,alpha=.02", 128, "uffizi.hdr", ["--model", "cook-torrance"]),
    "disney": ("the same, disney", "kd=.02,f0=.9,alpha=.02", 128, "uffizi.hdr", ["--model", "disney"]),
    "512": ("512 px, alpha .1", "kd=.4,.15,.08,f0=.05,alpha=.1", 512, "uffizi.hdr", GGX),
    "1024": ("1024 px, alpha .1", "kd=.4,.15,.08,f0=.05,alpha=.1", 1024, "uffizi.hdr", GGX),
}


def measure(command, out):
    """CPU seconds, wall seconds, MB of the largest process and the polished score of one run."""
    shutil.rmtree(out, ignore_errors=True)
    # A process of its own, so that its children's use is counted apart.
    code = (
        "import json, resource, subprocess, sys, time\n"
        "began = time.perf_counter()\n"
        "status = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)\n"
        "used = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(json.dumps([status.returncode, used.ru_utime + used.ru_stime, time.perf_counter() - began,"
        " used.ru_maxrss / 1000, status.stderr.decode()[-2000:]]))\n"
    )
    line = [sys.executable, "-c", code, *map(str, command), "--out", str(out), "--progress", "none"]
    status, cpu, wall, memory, said = json.loads(subprocess.run(line, capture_output=True, check=True).stdout)
    if status:
        sys.exit(f"{' '.join(map(str, command))} ended with status {status}: {said}")
    fit = json.loads((out / "fit.json").read_text())
    return cpu, wall, memory, fit["polished"]["cssim"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=pathlib.Path, required=True)
    parser.add_argument("--after", type=pathlib.Path, required=True)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--works", default=",".join(["demo", *PHOTOS]))
    options = parser.parse_args()
    print("| work | CPU s before | after | ratio | wall s before | after | MB before | after | CSSIM before | after |")
    print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for work in options.works.split(","):
            if work == "demo":
                what, arguments = "demo (192 px)", ["demo"]
            else:
                what, material, side, probe, flags = PHOTOS[work]
                photo, env = folder / f"{side}-{material[-2:]}.exr", options.data / "probes" / probe
                if not photo.exists():
                    render = [options.after, "render", "--model", "ggx", "--params", material, "--size", side, "--env", env, "--out", photo]
                    subprocess.run(list(map(str, render)), check=True, stderr=subprocess.DEVNULL)
                arguments = ["fit", photo, "--env", env, *flags]
            runs = {"before": [], "after": []}
            for _ in range(options.runs):
                for name, program in (("before", options.before), ("after", options.after)):
                    runs[name].append(measure([program, *arguments], folder / name))
            before, after = ([statistics.median(column) for column in zip(*of)] for of in runs.values())
            print(
                f"| {what} | {before[0]:.1f} | {after[0]:.1f} | {before[0] / after[0]:.1f} | {before[1]:.1f} | {after[1]:.1f}"
                f" | {before[2]:.0f} | {after[2]:.0f} | {before[3]:.4f} | {after[3]:.4f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
