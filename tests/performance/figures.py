#!/usr/bin/env python3
"""Measures the figures that the project claims and prints a line each: name, value, unit, target, met or short, change against
the recorded baseline, and what stands beside it (the least that the hardware allows; the state of what was measured).

usage: figures.py [--record] BIN_FOLDER [GROUP...]

dem     the particle side by itself, CPU time on one core, medians of three
gas     the gas by itself, likewise
transfer  between particles and gas, both ways, likewise
bed     whole beds from a fluidized state, by CPU time and the engine's summary.json
presets the presets on the Müller bed: what they cost, and what they say of it
peers   ours against LAMMPS on the same bed, in turn (needs Debian's package lammps)
scaling 1 and 2 ranks measured, up to 10 000 predicted by the cost model of scaling.py
trade   what the plan tells of a run before it, against what the run needs; what a scene pays for what it does not use
service submissions, 10 000 jobs, a million samples, 1000 watchers, on the real server and engine

--record keeps the figures as this machine's baseline. The exit code is 1 when a figure is short of its target.
"""
import json
import pathlib
import statistics
import sys

import peers
import scaling
import trade
from measuring import Baseline, Figure, cpu_seconds, engine, line, machine, run, scratch, sweep

# Figure -> (direction, limit).
TARGETS = {
    "dem/coulomb/settled": ("<=", 0.040),
    "dem/coulomb/agitated": ("<=", 0.040),
    "dem/coulomb/million": ("<=", 0.060),
    "dem/coulomb/memory": ("<=", 400),
    "dem/spring/settled": ("<=", 0.065),
    "dem/spring/agitated": ("<=", 0.065),
    "dem/spring/million": ("<=", 0.0975),
    "dem/spring/memory": ("<=", 700),
    "gas/projection/goldschmidt": ("<=", 0.8),
    "gas/projection/cube128": ("<=", 1.0),
    "gas/projection/memory": ("<=", 400),
    "gas/simple/memory": ("<=", 400),
    "gas/simple_over_projection/mueller": ("<=", 4),
    "gas/simple_over_projection/goldschmidt": ("<=", 4),
    "gas/simple_over_projection/cube64": ("<=", 4),
    "gas/two_ranks": (">=", 1.8),
    "transfer/mueller": ("<=", 0.10),
    "transfer/goldschmidt": ("<=", 0.10),
    "dem/hertz_mindlin/settled": ("<=", 0.075),
    "dem/hertz_mindlin/agitated": ("<=", 0.075),
    "dem/hertz_mindlin/million": ("<=", 0.1125),
    "dem/hertz_mindlin/memory": ("<=", 700),
    "dem/two_sizes": ("<=", 1.25),
    "dem/coulomb/two_ranks": (">=", 1.85),
    "peers/lammps/coulomb/settled": (">=", 3),
    "peers/lammps/coulomb/agitated": (">=", 3),
    "peers/lammps/spring/settled": (">=", 2.5),
    "peers/lammps/spring/agitated": (">=", 2.5),
    "bed/mueller/particle_substep": ("<=", 0.30),
    "bed/mueller/gas_and_transfer": ("<=", 30),
    "bed/goldschmidt-1.5/gas_and_transfer": ("<=", 30),
    "bed/mueller@mfix-exa-2018/gas_and_transfer": ("<=", 30),
    "bed/goldschmidt-1.5@mfix-exa-2018/gas_and_transfer": ("<=", 30),
    "bed/mueller@mfix-exa-2018/cost": ("<=", 112),
    "bed/goldschmidt-1.5@mfix-exa-2018/cost": ("<=", 200),
    **{f"trade/estimate/{what}/{scene}": ("<=", 1.3)
       for what in ("seconds", "memory", "checkpoint") for scene in trade.SCENES},
    **{f"plan/{name}": ("<=", most) for name, most in trade.UNUSED.items()},
    "service/submit/median": ("<=", 5),
    "service/list/first_page": ("<=", 50),
    "service/restart": ("<=", 2),
    "service/statistics/million": ("<=", 100),
    "service/statistics/million_first": ("<=", 100),
    "service/watchers/engine_cost": ("<=", 1),
    "service/watchers/memory": ("<=", 200),
}


def dem(bin_folder):
    alone = list(sweep(bin_folder, "dem", "settled|agitated|two_sizes"))
    yield from alone
    value = {figure.name: figure.value for figure in alone}
    yield Figure("dem/two_sizes", value["dem/coulomb/two_sizes"] / value["dem/coulomb/settled"], "times one size, coulomb")
    yield from sweep(bin_folder, "dem", "(coulomb|spring|hertz_mindlin)/million", repetitions=1)
    yield from scaling.two_ranks(bin_folder)
    for law in ("frictionless", "coulomb", "spring", "hertz_mindlin"):
        yield from sweep(bin_folder, "dem", f"{law}/memory", repetitions=1)  # each in a process of its own


def gas(bin_folder):
    value = {}
    for figure in sweep(bin_folder, "gas"):
        value[figure.name] = figure.value
        yield figure
    for bed in ("mueller", "goldschmidt", "cube64"):
        ratio = value[f"gas/simple/{bed}"] / value[f"gas/projection/{bed}"]
        yield Figure(f"gas/simple_over_projection/{bed}", ratio, "times a projection step")
    yield scaling.two_ranks_of_gas(bin_folder)


def transfer(bin_folder):
    yield from sweep(bin_folder, "transfer")


# What is changed of a ready case to have it fluidized after FLUIDIZED (simulated s): a start of 1 s takes the bed long.
FLUIDIZED, MEASURED = 0.5, 0.05
SOONER = {"mueller": [], "goldschmidt-1.5": ["domain.faces.y_low.inflow.ramp.duration=0.2"]}


def bed(bin_folder):
    for name in SOONER:
        for preset in ("mfix-exa-2018", ""):  # the paper's settings, and the ready case's own
            yield from whole_bed(bin_folder, name, preset)


def whole_bed(bin_folder, name, preset):
    """A bed on one rank: run until it is fluidized, then resumed and measured."""
    def case(end):
        changes = [part for change in [f"time.end={end}", *SOONER[name]] for part in ("--set", change)]
        return run([bin_folder / "bedflow", "init", name, *(["--preset", preset] if preset else []), *changes])
    with scratch() as folder:
        engine(bin_folder, case(FLUIDIZED), folder)
        before = cpu_seconds()
        summary = engine(bin_folder, case(FLUIDIZED + MEASURED), folder)
        cost = (cpu_seconds() - before) / summary["simulated_seconds"]
    bed_name = f"bed/{name}" + (f"@{preset}" if preset else "")
    substeps = summary["substeps"] / summary["steps"]
    yield Figure(f"{bed_name}/particle_substep", summary["particle_substep_microseconds"], "us per particle and sub-step, all told")
    yield Figure(f"{bed_name}/gas_and_transfer", 100 * (summary["gas_share"] + summary["transfer_share"]), "% of the time",
                 [f"gas {100 * summary['gas_share']:.3g}", f"transfer {100 * summary['transfer_share']:.3g}",
                  f"{substeps:.3g} sub-steps a step", f"{summary['gas_iterations'] / summary['steps']:.3g} outer iterations"])
    yield Figure(f"{bed_name}/cost", cost, "CPU s per simulated s")


PRESETS = ("mfix-exa-2018", "mfix-garg-upwind", "mfix-garg-smart", "mfix-dpvm-upwind", "mfix-dpvm-smart", "bedflow")


def presets(bin_folder, start=0.2, end=0.7):
    """Means from start to end (simulated s), of a bed that bubbles: they scatter from bed to bed."""
    for preset in PRESETS:
        def case(until, preset=preset):
            return run([bin_folder / "bedflow", "init", "mueller", "--preset", preset, "--set", f"time.end={until}"])
        with scratch() as folder:
            engine(bin_folder, case(start), folder)
            before = cpu_seconds()
            summary = engine(bin_folder, case(end), folder)
            cost = (cpu_seconds() - before) / summary["simulated_seconds"]
            said = json.loads(run([bin_folder / "bedflow", "stats", folder, "bed_pressure_drop", "bed_height", "--from", start,
                                   "--samples", "-o", "json"]))
        drops, heights = ([sample["value"] for sample in said if sample["name"] == name] for name in ("bed_pressure_drop", "bed_height"))
        gas = 100 * (summary["gas_share"] + summary["transfer_share"])
        yield Figure(f"presets/{preset}/cost", cost, "CPU s per simulated s", [f"gas and transfer {gas:.3g} %"])
        yield Figure(f"presets/{preset}/pressure_drop", statistics.mean(drops), "Pa",
                     [f"deviation in time {statistics.stdev(drops):.3g}", f"{len(drops)} samples"])
        yield Figure(f"presets/{preset}/bed_height", 1e3 * statistics.mean(heights), "mm, mean of the particles",
                     [f"deviation in time {1e3 * statistics.stdev(heights):.3g}"])


def service(bin_folder):
    for said in run([bin_folder / "bench_service"]).splitlines():
        name, value, unit, *notes = said.split(", ")
        yield Figure(name, float(value), unit, notes)


GROUPS = {"dem": dem, "gas": gas, "transfer": transfer, "bed": bed, "presets": presets,
          "peers": peers.against_lammps, "scaling": scaling.scaling, "trade": trade.trade,
          "service": service}


def main(arguments):
    recording = "--record" in arguments
    places = [argument for argument in arguments if argument != "--record"]
    if not places or any(group not in GROUPS for group in places[1:]):
        sys.exit(f"usage: figures.py [--record] BIN_FOLDER [{'|'.join(GROUPS)}]...")
    baseline, figures, any_short = Baseline(), [], False
    print(f"# {machine()}; " + (f"baseline of {baseline.machine}" if baseline.machine else "no baseline is recorded"), flush=True)
    for group in places[1:] or GROUPS:
        for figure in GROUPS[group](pathlib.Path(places[0]).resolve()):
            text, is_short = line(figure, TARGETS, baseline)
            print(text, flush=True)
            figures.append(figure)
            any_short |= is_short
    if recording:
        baseline.record(figures)
    return 1 if any_short else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
