#!/usr/bin/env python3
"""The cost of the runner, beside Dask distributed: nodes that do nothing, two worker processes of one thread each.

Usage: overhead.py [--program lookalike-overhead] [--repetitions N] [--nodes N ...] [--dask-nodes N ...] [--only-write]

Measures both in turn, so that other load on the machine affects both, and writes docs/overhead.json (every measurement) and the
tables of docs/overhead.md (between its markers). Needs Python 3.10 and the package `distributed`; first
`cargo build --release -p lookalike-tests --bin lookalike-overhead`.
"""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs/overhead.md"
FIGURES = ROOT / "docs/overhead.json"
ROUND = 21


def ours(program, *arguments):
    """The result of one measurement by lookalike-overhead."""
    done = subprocess.run([str(program), *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{program} {' '.join(map(str, arguments))}\n{done.stderr}")
    return {"of": "lookalike", **json.loads(done.stdout)}


def nothing(number):
    """A task that does nothing."""
    return number


class Dask:
    """A running cluster of two processes."""

    def __init__(self):
        import distributed

        self.version = distributed.__version__
        self.cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        self.client = distributed.Client(self.cluster)
        self.client.wait_for_workers(2)
        for _ in range(5):
            self.run(ROUND)

    def run(self, nodes):
        """Seconds for so many tasks, from the first word to the last result."""
        began = time.perf_counter()
        self.client.gather(self.client.map(nothing, range(nodes), pure=False))
        return time.perf_counter() - began

    def round_trip(self, rounds=30):
        took = sorted(1e3 * self.run(ROUND) for _ in range(rounds))
        return {"of": "dask", "measurement": "round-trip", "median_ms": statistics.median(took), "minimum_ms": took[0]}

    def throughput(self, nodes):
        seconds = self.run(nodes)
        rate = nodes / seconds
        return {"of": "dask", "measurement": "throughput", "nodes": nodes, "seconds": seconds, "nodes_per_second": rate}

    def close(self):
        self.client.close()
        self.cluster.close()


def measure(options):
    found = []
    dask = Dask()
    load = []

    def note(measured):
        found.append(measured)
        load.append(os.getloadavg()[0])
        print(json.dumps(measured), file=sys.stderr)

    for _ in range(options.repetitions):
        note(ours(options.program, "round-trip"))
        note(dask.round_trip())
        for nodes in sorted({*options.nodes, *options.dask_nodes}):
            if nodes in options.nodes:
                note(ours(options.program, "throughput", nodes))
            if nodes in options.dask_nodes:
                note(dask.throughput(nodes))
    dask.close()
    for killed in ["worker-killed", "worker-stopped", "coordinator-killed"]:
        note(ours(options.program, killed))
    machine = {"cores": os.cpu_count(), "system": platform.platform(), "load": [round(min(load), 1), round(max(load), 1)]}
    return {"machine": machine, "dask": dask.version, "measurements": found}


def tables(figures):
    """The tables of the document."""
    found = figures["measurements"]

    def of(whose, measurement, nodes=None):
        return [m for m in found if (m["of"], m["measurement"]) == (whose, measurement) and m["nodes" if nodes else "of"] == (nodes or whose)]

    def least(measured, figure):
        return min(m[figure] for m in measured)

    def most(measured, figure):
        return max(m[figure] for m in measured)

    machine = figures["machine"]
    lines = [
        f"Measured on {machine['cores']} cores with a load of {machine['load'][0]} to {machine['load'][1]} (of which the measurement is"
        f" 2 to 3), Dask distributed {figures['dask']}. Best of {len(of('lookalike', 'round-trip'))} repetitions of each.",
        "",
        "| | Lookalike | Dask distributed | ratio |",
        "|---|---:|---:|---:|",
    ]
    for title, figure in [(f"{ROUND} nodes there and back, median", "median_ms"), ("the same, minimum", "minimum_ms")]:
        a, b = (least(of(whose, "round-trip"), figure) for whose in ("lookalike", "dask"))
        lines.append(f"| {title} | {a:.2f} ms | {b:.1f} ms | {b / a:.0f} |")
    sizes = sorted({m["nodes"] for m in found if m["measurement"] == "throughput"})
    for nodes in sizes:
        a, b = of("lookalike", "throughput", nodes), of("dask", "throughput", nodes)
        a, b = (most(m, "nodes_per_second") if m else None for m in (a, b))
        shown = [f"{rate:,.0f}/s" if rate else "not run" for rate in (a, b)]
        lines.append(f"| {nodes:,} nodes | {shown[0]} | {shown[1]} | {f'{a / b:.0f}' if a and b else ''} |")
    lines += ["", "| nodes | microseconds per node, in each tenth of the run | coordinator: CPU per node | both workers: CPU per node | coordinator: memory at most |", "|---:|---|---:|---:|---:|"]
    for nodes in sizes:
        measured = of("lookalike", "throughput", nodes)
        if measured:
            best = max(measured, key=lambda m: m["nodes_per_second"])
            tenths = ", ".join(f"{tenth:.0f}" for tenth in best["tenths_us_per_node"])
            cpu = [f"{best[f'{who}_cpu_us_per_node']:.0f} us" for who in ("coordinator", "workers")]
            lines.append(f"| {nodes:,} | {tenths} | {cpu[0]} | {cpu[1]} | {best['coordinator_peak_mib']:.0f} MiB |")
    lines += ["", "| what happens | noticed after | work continues after | finished nodes that ran twice |", "|---|---:|---:|---:|"]
    for measured in found:
        name = measured["measurement"]
        if name.startswith("worker-SIG"):
            noticed = f"{measured['noticed_ms']:.0f} ms ({measured['noticed_heartbeats']:.2f} heartbeats)"
            then = f"{measured['rerun_ms']:.0f} ms"
            lines.append(f"| a worker gets {name[7:]} | {noticed} | {then} | {measured['finished_nodes_run_twice']} |")
        elif name == "coordinator-SIGKILL":
            back, then = f"all workers back: {measured['all_workers_back_ms']:.0f} ms", f"{measured['first_new_result_ms']:.0f} ms"
            lines.append(f"| the coordinator gets SIGKILL, the next one is started | {back} | {then} | {measured['finished_nodes_run_twice']} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/lookalike-overhead")
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--nodes", type=int, nargs="*", default=[10_000, 100_000])
    parser.add_argument("--dask-nodes", type=int, nargs="*", default=[10_000])
    parser.add_argument("--only-write", action="store_true", help="write the tables from docs/overhead.json")
    options = parser.parse_args()
    if not options.only_write:
        FIGURES.write_text(json.dumps(measure(options), indent=1) + "\n")
    begin, end = "<!-- tables: overhead.py -->", "<!-- end of tables -->"
    before, rest = DOCUMENT.read_text().split(begin)
    after = rest.split(end)[1]
    DOCUMENT.write_text(f"{before}{begin}\n{tables(json.loads(FIGURES.read_text()))}\n{end}{after}")


if __name__ == "__main__":
    main()
