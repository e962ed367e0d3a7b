"""What ranks cost: measured on 1 and 2 of them, their volumes on up to 8, and a cost model that is checked against both and then
predicts up to 10 000.

A bed is cut into columns a × b of its whole height. The busiest column takes, a sub-step,

    T = B n c + g (list + pack) + κ g contact + max(m latency + bytes g / bandwidth, log2(P) reduction)

    n, g    particles it owns, ghosts: g = ρ ((a + kx r)(b + kz r) − a b) with ρ particles over plan area, r the reach of the
            list and kx, kz = 0, 1, 2 the sides across which there is a neighbour
    c       seconds of a particle and sub-step where all cores are busy (each rank with a bed to itself)
    B       particles of the fullest rank over the mean
    κ       contacts across per ghost; each is computed on both sides
    m       directions in which there is a neighbour: both sides pass at once
    max     the ranks agree while the ghosts pass
    list, pack, contact   seconds of the list per particle, of packing a ghost, of a contact

All of it is measured here but for what NETWORK assumes.
"""
import json
import math
import os
import statistics

from measuring import Figure, run

REACH = 2.49e-3 * 1.1  # m, of the list: diameter and skin
BEDS = (1, 8)  # 198 000 particles
SUBSTEPS = 200
# Assumed, not measured: a common cluster. A node's 64 ranks are 8 × 8 columns, of whose 256 sides 32 lead out of the node.
NETWORK = {"latency": 2e-6, "bandwidth": 12.5e9 * 256 / 32 / 64, "reduction": 2e-6}
NETWORK_SAID = ("# assumed: 2 us a message and 2 us a stage of a reduction (log2 P stages), 12.5 GB/s a node of 64 ranks whose 8 x 8 columns "
                "share it; all else is measured here, c with both cores busy")
AS_ROOT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
RANKS = (1, 2, 4, 16, 64, 256, 1024, 4096, 10000)


def bench(bin_folder, ranks, *arguments):
    """What bench_scaling says; ranks that exceed the cores give volumes, not times."""
    bound = ["--bind-to", "core"] if ranks <= (os.cpu_count() or 1) else ["--oversubscribe", "--bind-to", "none"]
    environment = {**AS_ROOT}
    if ranks > (os.cpu_count() or 1):
        environment["OMPI_MCA_mpi_yield_when_idle"] = "1"
    said = json.loads(run(["mpirun", *bound, "-n", ranks, bin_folder / "bench_scaling", *arguments], env=environment))
    if "failure" in said:
        raise SystemExit(f"figures.py: bench_scaling: {said['failure']}")
    return said


def bed(bin_folder, ranks, law, substeps=SUBSTEPS):
    return bench(bin_folder, ranks, "bed", law, *BEDS, substeps)


def best(said):
    return min(said["seconds_per_substep"])


def total(said, name):
    return sum(said["ranks"][name])


def two_ranks(bin_folder, law="coulomb", turns=3):
    """How many times as fast two ranks are as one."""
    times = [(best(bed(bin_folder, 1, law)), best(bed(bin_folder, 2, law))) for _ in range(turns)]
    ratios = sorted(one / two for one, two in times)
    yield Figure(f"dem/{law}/two_ranks", statistics.median(ratios), "times as fast as one", [
        f"{'' if turns == 1 else f'from {ratios[0]:.3g} to {ratios[-1]:.3g}'}", "198000 particles"])


def two_ranks_of_gas(bin_folder, turns=5):
    """How many times as fast two ranks are as one on 96³ cells, wall time: the best of each, in turn. Both stream from memory, so
    what two cores together get of it, both asking, over what one alone gets bounds that."""
    def measured(ranks):
        said = run(["mpirun", "--bind-to", "core", "-n", ranks, bin_folder / "bench_gas", "--benchmark_format=json",
                    "--benchmark_filter=projection/cube96"], env=AS_ROOT)
        benchmark = json.loads(said)["benchmarks"][0]
        return benchmark["real_time"], benchmark["memory_bound"]
    times = [(*measured(1), *measured(2)) for _ in range(turns)]
    one, alone, two, shared = (min(column) for column in zip(*times))
    ratios = sorted(first / second for first, _, second, _ in times)
    return Figure("gas/two_ranks", one / two, "times as fast as one",
                  [f"bound {2 * alone / shared:.3g} (memory)", f"from {ratios[0]:.3g} to {ratios[-1]:.3g}", "96^3 cells"])


class Model:
    """The rates of the equation above, and the density of the bed."""

    def __init__(self, one, two, alone, messages):
        particles, (x, _, z) = total(one, "owned"), one["box"]
        self.density = particles / (x * z)
        self.particle = best(alone) / statistics.mean(alone["ranks"]["owned"])
        self.list = total(one, "pairs") / particles
        self.contact = total(one, "contacts") / total(one, "touching")
        self.across = total(two, "across") / total(two, "ghosts")
        self.pack = max(0.0, total(two, "migration") - total(two, "communication")) / total(two, "ghosts")
        self.bytes = total(two, "bytes") / total(two, "ghosts")
        exchange = messages["exchange"]
        wide, narrow = exchange[-1], exchange[0]
        self.here = {"latency": narrow["seconds"], "reduction": messages["reduction"],
                     "bandwidth": (wide["bytes"] - narrow["bytes"]) / (wide["seconds"] - narrow["seconds"])}

    def ghosts(self, column, sides):
        (a, b), (kx, kz) = column, sides
        return self.density * ((a + kx * REACH) * (b + kz * REACH) - a * b)

    def time(self, ranks, column, sides, balance, network):
        """Seconds of a sub-step, and of it what is communication."""
        owned, ghosts, passes = self.density * column[0] * column[1], self.ghosts(column, sides), sum(k > 0 for k in sides)
        work = balance * owned * self.particle + ghosts * (self.list + self.pack + self.across * self.contact)
        talk = passes * network["latency"] + (self.bytes * ghosts / network["bandwidth"] if passes else 0)
        talk = max(talk, math.log2(ranks) * network["reduction"])
        return work + talk, talk


def cuts(ranks):
    """Of a square bed: the factors of the ranks next to each other."""
    x = max(f for f in range(1, math.isqrt(ranks) + 1) if ranks % f == 0)
    return x, ranks // x


def predictions(model, kind, particles_of, balance):
    """Efficiency on many ranks, of the worst column of a square bed."""
    first = None
    for ranks in RANKS:
        particles = particles_of(ranks)
        edge, (x, z) = math.sqrt(particles / model.density), cuts(ranks)
        column, sides = (edge / x, edge / z), (min(x - 1, 2), min(z - 1, 2))
        name = f"scaling/{kind}/{ranks}"
        if min(column) < REACH:
            yield Figure(name, math.nan, "% efficiency", [f"a column of {1e3 * min(column):.2g} mm is narrower than the reach"])
            continue
        time, talk = model.time(ranks, column, sides, balance if ranks > 1 else 1, NETWORK)
        first = first or time * (ranks if kind == "strong" else 1)
        efficiency = first / (time * (ranks if kind == "strong" else 1))
        yield Figure(name, 100 * efficiency, "% efficiency, predicted", [
            f"{1e6 * time:.4g} us a sub-step", f"{particles / ranks:.4g} particles a rank",
            f"{model.ghosts(column, sides) / (particles / ranks):.2g} ghosts each", f"communication {100 * talk / time:.2g} %"])


def scaling(bin_folder, law="coulomb"):
    one, two = bed(bin_folder, 1, law), bed(bin_folder, 2, law)
    alone = bench(bin_folder, 2, "alone", law, BEDS[0], BEDS[1] // 2, SUBSTEPS)
    quiet = bench(bin_folder, 1, "alone", law, BEDS[0], BEDS[1] // 2, SUBSTEPS)
    model = Model(one, two, alone, bench(bin_folder, 2, "messages"))
    for name, value, unit in (
            ("particle", 1e9 * model.particle, "ns per particle and sub-step, all cores busy"),
            ("particle_quiet", 1e9 * best(quiet) / total(quiet, "owned"), "ns per particle and sub-step, the other core idle"),
            ("contact", 1e9 * model.contact, "ns per contact"), ("list", 1e9 * model.list, "ns per particle and sub-step"),
            ("pack", 1e9 * model.pack, "ns per ghost and sub-step"), ("bytes", model.bytes, "bytes per ghost and sub-step"),
            ("across", model.across, "contacts per ghost"), ("latency", 1e6 * model.here["latency"], "us a message, here"),
            ("bandwidth", 1e-9 * model.here["bandwidth"], "GB/s a rank, here"),
            ("reduction", 1e6 * model.here["reduction"], "us, two ranks, here")):
        yield Figure(f"scaling/rate/{name}", value, unit)

    x, _, z = one["box"]
    balances = []
    for ranks, px, pz in ((2, 2, 1), (4, 2, 2), (8, 4, 2)):
        said = two if ranks == 2 else bed(bin_folder, ranks, law, 20)
        owned, per_rank = said["ranks"]["owned"], said["ranks"]
        balances.append(max(owned) / statistics.mean(owned))
        predicted = model.ghosts((x / px, z / pz), (min(px - 1, 2), min(pz - 1, 2)))
        yield Figure(f"scaling/volume/{ranks}", max(per_rank["ghosts"]), "ghosts of the rank with most", [
            f"predicted {predicted:.4g}", f"{max(per_rank['messages']):.3g} messages and {max(per_rank['bytes']):.4g} bytes a sub-step",
            f"{max(per_rank['across']):.0f} contacts across",
            f"{total(said, 'arrived') / max(1, said['rebuilds']):.3g} particles arrive a rebuild", f"balance {balances[-1]:.3f}"])

    measured = best(two)
    predicted, _ = model.time(2, (x / 2, z), (1, 0), balances[0], model.here)
    yield Figure("scaling/two_ranks/measured", 1e6 * measured, "us a sub-step", [f"{best(one) / measured:.3g} times as fast as one"])
    yield Figure("scaling/two_ranks/predicted", 1e6 * predicted, "us a sub-step", [f"{100 * (predicted / measured - 1):+.1f} % of measured"])
    print(NETWORK_SAID, f"; balance {max(balances):.3f}", sep="", flush=True)
    yield from predictions(model, "weak", lambda ranks: 1e5 * ranks, max(balances))
    yield from predictions(model, "strong", lambda ranks: 1e7, max(balances))
