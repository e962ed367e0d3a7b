"""Ours against peers: the same bed, laws, parameters and steps, in turn on one core; how many times as fast ours is."""
import os
import pathlib
import re
import shutil
import statistics
import tempfile

from measuring import FOLDER, Figure, one_core, run, sweep

BED = pathlib.Path(tempfile.gettempdir()) / "bedflow_bench_bed_1_1.data"  # made by bench_dem
LAWS = {"coulomb": "hooke", "spring": "hooke/history"}
STATES = {"settled": {"shaken": 0, "steps": 1000, "warm_up": 200}, "agitated": {"shaken": 1, "steps": 6660, "warm_up": 0}}


def lammps(law, state):
    """CPU µs per particle and step, contacts per particle and steps per rebuild, by what LAMMPS prints."""
    variables = {"data": BED, "law": LAWS[law], **STATES[state]}
    command = ["lmp", "-in", FOLDER / "peers" / "bed.in", "-log", "none"]
    for name, value in variables.items():
        command += ["-var", name, value]
    said = run(command, one_core(), env={**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"})
    return read(said)


def read(said):
    """Of the last run; rebuilds of all."""
    loops = re.findall(r"Loop time of (\S+) on 1 procs for (\d+) steps with (\d+) atoms", said)
    seconds, steps, atoms = map(float, loops[-1])
    last = said[said.rindex("Step c_contacts"):]
    busy = float(re.search(r"([\d.]+)% CPU use", last)[1]) / 100
    contacts = [float(value) for value in re.findall(r"^ *\d+ +([\d.e+-]+) *$", last, re.MULTILINE)]
    builds = int(re.search(r"Neighbor list builds = (\d+)", last)[1])
    return {"figure": seconds * busy / steps / atoms * 1e6, "contacts": statistics.mean(contacts),
            "rebuild": sum(int(loop[1]) for loop in loops) / max(1, builds)}


def against_lammps(bin_folder, turns=3):
    if not shutil.which("lmp"):
        print("# peers: LAMMPS is not here; `apt-get install --no-install-recommends lammps` brings it", flush=True)
        return
    for law in LAWS:
        for state in STATES:
            rounds = []
            for _ in range(turns):
                ours = next(sweep(bin_folder, "dem", f"^{law}/{state}/", repetitions=1))
                rounds.append((ours, lammps(law, state)))
            ratios = sorted(theirs["figure"] / ours.value for ours, theirs in rounds)
            ours, theirs = rounds[-1]
            yield Figure(f"peers/lammps/{law}/{state}", statistics.median(ratios), "times as fast", [
                f"from {ratios[0]:.2f} to {ratios[-1]:.2f}",
                f"ours {statistics.median(r[0].value for r in rounds):.3g}",
                f"theirs {statistics.median(r[1]['figure'] for r in rounds):.3g} us per particle and sub-step",
                *[note for note in ours.notes if note.startswith(("contacts", "substeps"))],
                f"theirs {theirs['contacts']:.3g} and {theirs['rebuild']:.3g}"])
