"""A figure, its line, and how programs are run to get one."""
import dataclasses
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent


@dataclasses.dataclass
class Figure:
    name: str
    value: float
    unit: str
    notes: list = dataclasses.field(default_factory=list)  # what the figure is of, and what it could be at best


class Baseline:
    """Figures recorded on a machine; they compare with those of no other."""

    def __init__(self, path=FOLDER / "baseline.json"):
        self.path = path
        recorded = json.loads(path.read_text()) if path.exists() else {}
        self.machine, self.figures = recorded.get("machine"), recorded.get("figures", {})

    def change(self, figure):
        if self.machine != machine() or figure.name not in self.figures:
            return "-"
        return f"{100 * (figure.value / self.figures[figure.name] - 1):+.0f} %"

    def record(self, figures):
        kept = self.figures if self.machine == machine() else {}
        kept.update({figure.name: float(f"{figure.value:.4g}") for figure in figures})
        self.path.write_text(json.dumps({"machine": machine(), "figures": dict(sorted(kept.items()))}, indent=2) + "\n")


def machine():
    """The processor by name, family and model (virtual machines hide the name), with its cores."""
    said = dict(line.split(":", 1) for line in pathlib.Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines())
    said = {key.strip(): value.strip() for key, value in said.items()}
    name = " ".join([said.get("model name", "unknown"), "family", said.get("cpu family", "?"), "model", said.get("model", "?")])
    return f"{name}, {os.cpu_count()} cores"


def line(figure, targets, baseline):
    """The printed line, and whether the figure is short of its target: name, value, unit, target, met or short, change, notes."""
    target, verdict = "-", "-"
    if figure.name in targets:
        direction, limit = targets[figure.name]
        met = figure.value <= limit if direction == "<=" else figure.value >= limit
        target, verdict = f"{direction} {limit:g}", "met" if met else "short"
    parts = [figure.name, f"{figure.value:.4g}", figure.unit, target, verdict, baseline.change(figure), *figure.notes]
    return ", ".join(parts), verdict == "short"


def run(command, core=None, **options):
    """The output of a command, on one core unless it is None; its errors end the measurement."""
    pinned = [] if core is None else ["taskset", "-c", str(core)]
    command = [*pinned, *map(str, command)]
    result = subprocess.run(command, capture_output=True, text=True, **options)
    if result.returncode != 0:
        sys.exit(f"figures.py: {' '.join(command)} ended with {result.returncode}:\n{result.stderr}{result.stdout[-2000:]}")
    return result.stdout


def cpu_seconds():
    """Of all commands that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def one_core():
    return min(os.sched_getaffinity(0))


def sweep(bin_folder, group, only=".", repetitions=3):
    """Figures of bench_GROUP (Google Benchmark): medians of the counter `figure`, or of CPU time, in the unit that is its label."""
    program = bin_folder / f"bench_{group}"
    if not program.exists():
        sys.exit(f"figures.py: there is no {program}; build it with deploy/build.sh")
    report = json.loads(run([program, "--benchmark_format=json", f"--benchmark_filter={only}",
                             f"--benchmark_repetitions={repetitions}"], one_core()))
    runs = {}
    for entry in report["benchmarks"]:
        if entry.get("error_occurred"):
            sys.exit(f"figures.py: {entry['name']}: {entry['error_message']}")
        if entry.get("run_type") == "iteration":
            runs.setdefault(entry["run_name"].split("/iterations:")[0], []).append(entry)
    for name, entries in runs.items():
        def median(key):
            return statistics.median(entry[key] for entry in entries)
        value, unit = median("cpu_time"), entries[0]["time_unit"] + " per call"
        if "figure" in entries[0]:
            value, unit = median("figure"), entries[0].get("label", "")
        notes = bound({key.removesuffix("_bound"): median(key) for key in entries[0] if key.endswith("_bound")})
        notes += [f"{key.replace('_', ' ')} {median(key):.3g}" for key in NOTED if key in entries[0]]
        yield Figure(f"{group}/{name}", value, unit, notes)


NOTED = ("contacts_per_particle", "substeps_per_rebuild", "bed_height_mm", "outer", "pressure_iterations")


def bound(bounds):
    """The longest of the least times that parts of the hardware need is the one that binds."""
    if not bounds:
        return []
    binding = max(bounds, key=bounds.get)
    others = "".join(f"; {name} {least:.3g}" for name, least in bounds.items() if name != binding)
    return [f"bound {bounds[binding]:.3g} ({binding}{others})"]


def engine(bin_folder, case, folder):
    """summary.json of a case that one rank runs in the folder, resuming what is there."""
    (pathlib.Path(folder) / "case.txtpb").write_text(case)
    run([bin_folder / "bedflow-engine", folder], one_core())
    return json.loads((pathlib.Path(folder) / "summary.json").read_text())


def scratch():
    return tempfile.TemporaryDirectory(prefix="bedflow-bench-")
