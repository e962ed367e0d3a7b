#!/usr/bin/env python3
"""Measures the figures that the project claims and prints a line each: name, value, unit, target, and met or short.

usage: figures.py BIN_FOLDER [GROUP...]

A sweep (Google Benchmark) is a figure by its counter `figure`, with the unit as its label; without the counter its CPU time
is shown. Whole beds are figures by the engine's summary.json. Everything runs on one core; sweeps are medians of three.
The exit code is 1 when a figure is short of its target.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

GROUPS = ("dem", "gas", "bed")
# Targets, lower is better: figure -> (unit, most).
TARGETS = {
    "bed/mueller/particle_substep": ("us per particle and sub-step, all told", 0.30),
    "bed/mueller/gas_share": ("% of the time", 40),
}


def run(command, **options):
    """The output of a command on one core; its errors end the measurement."""
    core = min(os.sched_getaffinity(0))
    result = subprocess.run(["taskset", "-c", str(core), *map(str, command)], capture_output=True, text=True, **options)
    if result.returncode != 0:
        sys.exit(f"figures.py: {' '.join(map(str, command))} ended with {result.returncode}:\n{result.stderr}{result.stdout[-2000:]}")
    return result.stdout


def sweep(bin_folder, group):
    """Figures of bench_GROUP: (name, value, unit)."""
    program = bin_folder / f"bench_{group}"
    if not program.exists():
        sys.exit(f"figures.py: there is no {program}; build it with deploy/build.sh")
    report = json.loads(run([program, "--benchmark_format=json", "--benchmark_repetitions=3",
                             "--benchmark_report_aggregates_only=true"]))
    for entry in report["benchmarks"]:
        if entry.get("aggregate_name") != "median":
            continue
        value, unit = entry["cpu_time"], entry["time_unit"] + " per call"
        if "figure" in entry:
            value, unit = entry["figure"], entry.get("label", "")
        yield f"{group}/{entry['run_name']}", value, unit


def bed(bin_folder, name="mueller", fluidized=0.25, measured=0.05):
    """Figures of a whole bed on one rank: run until it is fluidized, then resumed and measured (simulated s)."""
    with tempfile.TemporaryDirectory(prefix="bedflow-bench-") as folder:
        for end in (fluidized, fluidized + measured):
            case = run([bin_folder / "bedflow", "init", name, "--set", f"time.end={end}"])
            (pathlib.Path(folder) / "case.txtpb").write_text(case)
            run([bin_folder / "bedflow-engine", folder])
        summary = json.loads((pathlib.Path(folder) / "summary.json").read_text())
    yield f"bed/{name}/particle_substep", summary["particle_substep_microseconds"], "us per particle and sub-step, all told"
    yield f"bed/{name}/gas_share", 100 * summary["gas_share"], "% of the time"
    yield f"bed/{name}/transfer_share", 100 * summary["transfer_share"], "% of the time"
    yield f"bed/{name}/cost", summary["cpu_seconds_per_simulated_second"], "CPU s per simulated s"


def line(name, value, unit, targets):
    """The printed line, and whether the figure is short of its target."""
    if name not in targets:
        return f"{name}, {value:.4g}, {unit}, -, -", False
    most = targets[name][1]
    return f"{name}, {value:.4g}, {unit}, <= {most:g}, {'met' if value <= most else 'short'}", not value <= most


def main():
    if len(sys.argv) < 2 or any(group not in GROUPS for group in sys.argv[2:]):
        sys.exit(f"usage: figures.py BIN_FOLDER [{'|'.join(GROUPS)}]...")
    bin_folder = pathlib.Path(sys.argv[1]).resolve()
    any_short = False
    for group in sys.argv[2:] or GROUPS:
        for figure in bed(bin_folder) if group == "bed" else sweep(bin_folder, group):
            text, is_short = line(*figure, TARGETS)
            print(text, flush=True)
            any_short |= is_short
    return 1 if any_short else 0


if __name__ == "__main__":
    sys.exit(main())
