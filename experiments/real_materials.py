#!/usr/bin/env python3
"""Fits of real materials under real light: CSSIM over gamma, the winner, its margin over gamma = 1, the gain of polish.

Usage: real_materials.py --data DIR --make-merl make_merl.py [--lookalike PROGRAM] [--work DIR] [--only MATERIAL-PROBE ...]

Renders four measured materials under three light probes (existing photos are kept), fits each with the models (--models; with --pattern
once more with pattern search), and writes docs/real-materials.csv (every candidate) and the tables of docs/real-materials.md (between its
markers).
Needs Python 3.10 and, for make_merl.py, numpy. About an hour on two cores.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

MATERIALS = ["gold-metallic-paint3", "aluminium", "red-metallic-paint", "blue-acrylic"]
# Samples per pixel: the noise of a typical pixel is at most 1.3 % (docs/real-materials.md).
PROBES = {"rnl_cross": ("Eucalyptus Grove", 3072), "grace_cross": ("Grace Cathedral", 3072), "uffizi": ("Uffizi", 6144)}
MODELS = ["ggx", "cook-torrance"]
ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs/real-materials.md"
CSV = ROOT / "docs/real-materials.csv"


def run(command):
    """Standard error of a command that has to succeed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stderr


def photo(options, material, probe):
    """Path of a rendering and the sentence about its noise."""
    exr, said = (options.work / f"{material}-{probe}{suffix}" for suffix in (".exr", ".txt"))
    if not exr.exists():
        table = options.work / f"{material}.binary"
        if not table.exists():
            run([sys.executable, options.make_merl, options.data / f"materials/{material}.nbrdf.json", table])
        partial = exr.with_suffix(".part.exr")
        light = ["--env", options.data / f"probes/{probe}.hdr"]
        size = ["--size", 256, "--samples", PROBES[probe][1]]
        said.write_text(run([options.lookalike, "render", "--brdf", table, *light, *size, "-o", partial]))
        partial.rename(exr)
    return exr, re.search(r"noise: ([\d.]+) % .*?([\d.]+) %", said.read_text()).groups()


def fit(options, material, probe, model, *flags):
    """fit.json of a fit, which is run unless it is there."""
    out = options.work / "-".join([material, probe, model, *[flag.strip("-") for flag in flags]])
    if not (out / "fit.json").exists():
        exr, _ = photo(options, material, probe)
        light = ["--env", options.data / f"probes/{probe}.hdr"]
        command = [options.lookalike, "fit", exr, *light, "--model", model, *flags, "--out", out, "--progress", "none"]
        run(command)
    return json.loads((out / "fit.json").read_text())


def percent(part, whole):
    return f"{100 * (1 - part / whole):.1f} %"


def width(parameters):
    return parameters.get("alpha", parameters.get("m"))


def row_of_scores(case, noise, result):
    """One line of the table of scores."""
    scores = {candidate["gamma"]: candidate["cssim"] for candidate in result["candidates"]}
    winner, polished = result["stage_two"], result["polished"]
    gamma = winner["gamma"]
    said = {1.0: f"{gamma:.1f} (L2 wins)", max(scores): f"{gamma:.1f} (end of the range)"}.get(gamma, f"{gamma:.1f}")
    margin = percent(winner["cssim"], scores[1.0])
    gain = percent(polished["cssim"], winner["cssim"])
    widths = f"{width(winner['parameters']):.4f} | {width(polished['parameters']):.4f}"
    shown = " | ".join(f"{scores[g]:.4f}" for g in (1.0, 2.0, 3.0))
    return f"| {case} | {noise[0]} % | {shown} | {said} | {winner['cssim']:.4f} | {margin} | {polished['cssim']:.4f} | {gain} | {widths} |"


def table(header, rows):
    columns = header.count("|") - 1
    return "\n".join([header, "|" + "---|" * columns, *rows])


def costs(least_squares, pattern):
    """Ratios of the costs of pattern search to those of least squares over the gammas, and their evaluations."""
    pairs = list(zip(least_squares["candidates"], pattern["candidates"]))
    ratios = [p["cost"] / l["cost"] for l, p in pairs]
    evaluations = [sum(c["evaluations"] for c in side) / len(pairs) for side in zip(*pairs)]
    return f"{min(ratios):.4f} | {max(ratios):.4f} | {evaluations[0]:.0f} | {evaluations[1]:.0f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--make-merl", type=pathlib.Path, required=True)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/real-materials")
    parser.add_argument("--models", nargs="*", default=MODELS)
    parser.add_argument("--pattern", action="store_true", help="also compare the searches (long)")
    parser.add_argument("--only", nargs="*", default=[])
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    begin, end = "<!-- tables: real_materials.py -->", "<!-- end of tables -->"
    before, after = DOCUMENT.read_text().split(begin)[0], DOCUMENT.read_text().split(end)[1]

    cases = [(m, p) for p in PROBES for m in MATERIALS if not options.only or f"{m}-{p}" in options.only]
    rows, comparison, lines = {model: [] for model in options.models}, [], []
    for material, probe in cases:
        _, noise = photo(options, material, probe)
        case = f"{material}, {PROBES[probe][0]}"
        for model in options.models:
            result = fit(options, material, probe, model)
            rows[model].append(row_of_scores(case, noise, result))
            for c in result["candidates"]:
                numbers = [c["gamma"], *(f"{c[name]:.6g}" for name in ("cost", "cssim", "cssim_object")), c["evaluations"]]
                lines.append([material, probe, model, *numbers, f"{width(c['parameters']):.5g}"])
        if options.pattern:
            pattern = fit(options, material, probe, "ggx", "--search=pattern", "--polish=off")
            comparison.append(f"| {case} | {costs(fit(options, material, probe, 'ggx'), pattern)} |")
        print(rows[options.models[0]][-1], flush=True)

    scores = "| case | noise | CSSIM at 1 | at 2 | at 3 | winning gamma | its CSSIM | below gamma 1 | polished | gain | {0} of the winner | {0} polished |"
    parts = [f"### {m}\n\n" + table(scores.format("alpha" if m == "ggx" else "m"), rows[m]) for m in options.models]
    header = "| case | smallest ratio | largest ratio | evaluations, least squares | evaluations, pattern |"
    if options.pattern:
        parts.append("### Cost of pattern search over that of least squares (ggx, 21 gammas)\n\n" + table(header, comparison))
    names = "material,probe,model,gamma,cost,cssim,cssim_object,evaluations,width"
    text = "\n".join([names, *(",".join(map(str, line)) for line in lines)]) + "\n"
    if options.only:
        print("\n\n".join(parts))
        return
    CSV.write_text(text)
    DOCUMENT.write_text(f"{before}{begin}\n\n" + "\n\n".join(parts) + f"\n\n{end}{after}")


if __name__ == "__main__":
    main()
