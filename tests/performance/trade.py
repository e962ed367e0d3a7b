"""What a user is told before a run, against what the run then needs; and what a scene pays for what it does not use."""
import os
import pathlib
import re
import subprocess

from measuring import Figure, one_core, run, scratch

# Scene -> what is changed of the ready case, so that it takes seconds.
SCENES = {
    "mueller": ["time.end=0.15"],
    "mueller@mfix-exa-2018": ["time.end=0.15"],
    "goldschmidt-1.5": ["time.end=0.3", "domain.faces.y_low.inflow.ramp.duration=0.1"],
    "link-b2": ["time.end=0.02"],
    "settling": [],
    "channel": [],
}


def case_of(bin_folder, scene, changes):
    name, _, preset = scene.partition("@")
    set_options = [part for change in changes for part in ("--set", change)]
    return run([bin_folder / "bedflow", "init", name, *(["--preset", preset] if preset else []), *set_options])


def told(bin_folder, case):
    """Seconds, bytes of memory and bytes of a checkpoint, by the plan."""
    text = run([bin_folder / "bedflow-engine", "--plan", case])
    return {name: float(re.search(rf"^{name}: (\S+)", text, re.M)[1]) for name in ("seconds", "memory_bytes", "checkpoint_bytes")}


def needed(bin_folder, folder):
    """The same of the run: CPU seconds of the process, its largest resident set, its last checkpoint."""
    with subprocess.Popen(["taskset", "-c", str(one_core()), bin_folder / "bedflow-engine", folder],
                          stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = status
    if status != 0:
        raise SystemExit(f"figures.py: the engine ended with {status}")
    checkpoints = sorted(pathlib.Path(folder).glob("checkpoints/*.h5"))
    return {"seconds": used.ru_utime + used.ru_stime, "memory_bytes": 1024 * used.ru_maxrss,
            "checkpoint_bytes": checkpoints[-1].stat().st_size}


def estimates(bin_folder):
    """How far off the plan is: the larger of the two over the smaller."""
    for scene, changes in SCENES.items():
        with scratch() as folder:
            case = pathlib.Path(folder) / "case.txtpb"
            case.write_text(case_of(bin_folder, scene, changes))
            plan, real = told(bin_folder, case), needed(bin_folder, folder)
        for name, unit, factor in (("seconds", "s", 1), ("memory_bytes", "MB", 1e-6), ("checkpoint_bytes", "MB", 1e-6)):
            off = max(plan[name] / real[name], real[name] / plan[name])
            yield Figure(f"trade/estimate/{name.removesuffix('_bytes')}/{scene}", off, "times off",
                         [f"told {factor * plan[name]:.3g} {unit}", f"needed {factor * real[name]:.3g} {unit}"])


# What a scene may pay for what it does not use (bench_plan) -> the most, and why not less.
UNUSED = {
    "particles_alone": 1.05,       # the engine around the bare sweeps: a look at every particle a step, the vote, the clock
    "gas_alone": 1.05,             # the engine around the bare solver: the guard reads the velocity once a step
    "frictionless": 0.85,          # no spins and no torques: a quarter of a contact's arithmetic
    "no_history": 0.70,            # no memory of contacts: neither its arithmetic nor its 32 bytes a pair
    "one_size/listed": 1.03,       # the same scene, said in another way: 1 and what medians scatter
    "one_size/one_class": 1.03,
    "walls_far_away": 1.03,        # a look at a list that is empty
    "energy_watch": 1.02,          # the contacts are looked through once in 16 steps
    "freeboard/transfer": 1.15,    # the gas fraction of each cell is set and read, here of eight times as many; all else is by particles
    "freeboard/particles": 1.05,   # none: 1 and what the fastest of some steps scatters
    "empty_bed": 1.06,             # likewise, beside the gas of the same cells
    "resting/rebuilds": 5,         # a few particles bounce on its surface for long: one moves half a skin in some 300 sub-steps
    "resting/lists": 8,            # so many rebuilds of a spring's list, each worth some 15 sub-steps
}


def unused(bin_folder):
    for said in run([bin_folder / "bench_plan"], one_core()).splitlines():
        name, value, unit, *notes = said.split(", ")
        yield Figure(name, float(value), unit, notes)


def trade(bin_folder):
    yield from estimates(bin_folder)
    yield from unused(bin_folder)
