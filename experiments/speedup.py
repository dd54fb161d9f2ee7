#!/usr/bin/env python3
"""How much faster two workers are than one, on this machine, and how long they were idle.

Usage: speedup.py [--program lookalike] [--out DIR] COMMAND ARGUMENTS...

COMMAND is `fit` or `batch` with its arguments, without --out and --workers. It runs twice, with one and with two workers of one thread
each, which join by the access file as remote ones do. Prints the seconds of both, their ratio, and from the journal of the second
run how long both workers, one, or none held a node. First `cargo build --release --bin lookalike`. Needs Python 3.10.
"""
import argparse
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


def run(program, command, out, workers):
    """Seconds that the command takes with so many workers."""
    shutil.rmtree(out, ignore_errors=True)
    line = [program, *command, "--out", out, "--workers", "0", "--listen", "127.0.0.1:0", "--progress", "none"]
    began = time.perf_counter()
    coordinator = subprocess.Popen(list(map(str, line)), stdout=subprocess.DEVNULL)
    access = out / "access.json"
    while not access.exists():
        if coordinator.poll() is not None:
            sys.exit(f"the run ended with status {coordinator.returncode} before it began")
        time.sleep(0.01)
    worker = [str(program), "worker", "--access", str(access), "--threads", "1"]
    helpers = [subprocess.Popen(worker, stderr=subprocess.DEVNULL) for _ in range(workers)]
    status = coordinator.wait()
    took = time.perf_counter() - began
    for helper in helpers:
        helper.wait()
    if status:
        sys.exit(f"the run with {workers} workers ended with status {status}")
    return took


def intervals(journal):
    """When each worker held a node: lists of (begin, end) in milliseconds, none of a worker's overlapping."""
    connection = sqlite3.connect(f"file:{journal}?mode=ro", uri=True)
    rows = connection.execute(
        "SELECT worker, begun_ms, ended_ms FROM attempt_list WHERE ended_ms IS NOT NULL ORDER BY worker, begun_ms"
    )
    workers = {}
    for worker, begun, ended in rows:
        spans = workers.setdefault(worker, [])
        if spans and begun <= spans[-1][1]:
            spans[-1][1] = max(spans[-1][1], ended)
        else:
            spans.append([begun, ended])
    return list(workers.values())


def shares(workers):
    """Seconds in which 1, 2, ... workers held a node, between the first lease and the last."""
    changes = sorted((time, step) for spans in workers for begun, ended in spans for time, step in ((begun, 1), (ended, -1)))
    held, last, seconds = 0, changes[0][0], {}
    for moment, step in changes:
        seconds[held] = seconds.get(held, 0) + (moment - last) / 1e3
        held, last = held + step, moment
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("speedup"))
    parser.add_argument("command", nargs=argparse.REMAINDER)
    options = parser.parse_args()
    if not options.command:
        parser.error("expected a command: fit or batch with its arguments")
    one = run(options.program, options.command, options.out / "one", 1)
    two = run(options.program, options.command, options.out / "two", 2)
    print(f"one worker {one:.1f} s, two workers {two:.1f} s: {one / two:.2f} times as fast")
    for count, seconds in sorted(shares(intervals(options.out / "two" / "run.sqlite")).items(), reverse=True):
        print(f"  {count} workers held a node for {seconds:.1f} s ({100 * seconds / two:.0f} % of the time)")


if __name__ == "__main__":
    main()
