#!/usr/bin/env python3
"""Submits a bed, and draws it while it runs: the gas fraction in the middle layer, some particles, and a monitor over time.

usage: plot_running_bed.py CASE [--server ADDRESS] [--ranks N] [--out bed.png] [--every SECONDS]

Needs python3-matplotlib beside what bedflow needs. Without it the numbers are printed.
"""
import argparse
import sys
import time

import bedflow


def numbers(job):
    """What the pictures are drawn from, of the newest checkpoint."""
    layer = job.slice("gas_fraction", axis="z")
    grains = job.sample("particle_x", "particle_y", "particle_speed", most=5000)
    return layer, grains, job.statistics(most=500)


def draw(job, layer, grains, statistics, out):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, (gas, solids, history) = pyplot.subplots(1, 3, figsize=(14, 6))
    x, y = layer.axes["x"], layer.axes["y"]
    image = gas.pcolormesh(x, y, layer.values["gas_fraction"], vmin=0.35, vmax=1, shading="nearest")
    figure.colorbar(image, ax=gas, label="gas fraction")
    dots = solids.scatter(grains.values["particle_x"], grains.values["particle_y"], c=grains.values["particle_speed"], s=3)
    figure.colorbar(dots, ax=solids, label="speed / m/s")
    for axes in (gas, solids):
        axes.set_aspect("equal")
        axes.set_xlabel("x / m")
    for series in statistics.values():
        if isinstance(series, bedflow.Series) and len(series.time):
            history.plot(series.time, series.value, label=f"{series.name} / {series.unit}")
    history.set_xlabel("time / s")
    history.legend()
    figure.suptitle(f"{job.message.case_name}, {job.id}, t = {layer.time:.4g} s")
    figure.tight_layout()
    figure.savefig(out)
    pyplot.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case")
    parser.add_argument("--server")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--out", default="bed.png")
    parser.add_argument("--every", type=float, default=5, help="wall seconds between pictures")
    arguments = parser.parse_args()
    with bedflow.connect(arguments.server) as server:
        job = server.submit(arguments.case, ranks=arguments.ranks)
        print(job.id)
        last = 0.0
        for event in job.watch():
            if event.HasField("progress"):
                print(f"t = {event.progress.time:.4g} of {event.progress.end_time:.4g} s", file=sys.stderr)
            due = time.monotonic() - last > arguments.every
            if not (event.HasField("checkpoint") or due and job.checkpoints()):
                continue
            last = time.monotonic()
            layer, grains, statistics = numbers(job)
            try:
                draw(job, layer, grains, statistics, arguments.out)
                print(f"drawn: {arguments.out}, step {layer.step}", file=sys.stderr)
            except ImportError:
                print(f"step {layer.step}: mean gas fraction {layer.values['gas_fraction'].mean():.4f}", file=sys.stderr)
        print(job.refresh().state)


if __name__ == "__main__":
    main()
