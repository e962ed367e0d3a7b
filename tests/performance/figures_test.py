"""The lines of deploy/bench.sh: a figure on the wrong side of its target, or none at all, is never called met."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import figures  # noqa: E402
import measuring  # noqa: E402
import peers  # noqa: E402
import scaling  # noqa: E402
from measuring import Baseline, Figure  # noqa: E402

NO_BASELINE = Baseline(pathlib.Path("/nowhere"))


def line(name, value, baseline=NO_BASELINE, notes=()):
    return measuring.line(Figure(name, value, "s", list(notes)), {"time": ("<=", 2), "speed": (">=", 3)}, baseline)


class Figures(unittest.TestCase):
    def test_a_figure_is_met_up_to_its_target_and_short_beyond(self):
        self.assertEqual(line("time", 2), ("time, 2, s, <= 2, met, -", False))
        self.assertEqual(line("time", 2.01), ("time, 2.01, s, <= 2, short, -", True))
        self.assertEqual(line("speed", 3), ("speed, 3, s, >= 3, met, -", False))
        self.assertEqual(line("speed", 2.99), ("speed, 2.99, s, >= 3, short, -", True))

    def test_no_number_is_short(self):
        self.assertTrue(line("time", float("nan"))[1])
        self.assertTrue(line("speed", float("nan"))[1])

    def test_a_figure_without_a_target_is_only_shown(self):
        self.assertEqual(line("other", 1, notes=["beside"]), ("other, 1, s, -, -, -, beside", False))

    def test_a_figure_is_compared_with_the_baseline_of_its_own_machine_only(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "baseline.json"
            Baseline(path).record([Figure("time", 1.6, "s")])
            self.assertEqual(line("time", 2, Baseline(path))[0], "time, 2, s, <= 2, met, +25 %")
            path.write_text(path.read_text().replace(measuring.machine(), "another"))
            self.assertEqual(line("time", 2, Baseline(path))[0], "time, 2, s, <= 2, met, -")

    def test_the_longest_bound_binds(self):
        self.assertEqual(measuring.bound({"memory": 2.0, "arithmetic": 1.0}), ["bound 2 (memory; arithmetic 1)"])

    def test_targets_have_a_direction(self):
        self.assertLessEqual({direction for direction, _ in figures.TARGETS.values()}, {"<=", ">="})


class Lammps(unittest.TestCase):
    def test_its_cpu_time_contacts_and_rebuilds_are_read(self):
        said = """Step c_contacts
       0     1.0
     200     5.0
Loop time of 9 on 1 procs for 200 steps with 1000 atoms
10.0% CPU use with 1 MPI tasks x 1 OpenMP threads
Step c_contacts
     200     5.0
     700     5.2
Loop time of 5 on 1 procs for 500 steps with 1000 atoms

80.0% CPU use with 1 MPI tasks x 1 OpenMP threads
Neighbor list builds = 4
"""
        read = peers.read(said)
        self.assertAlmostEqual(read["figure"], 8.0)
        self.assertAlmostEqual(read["contacts"], 5.1)
        self.assertAlmostEqual(read["rebuild"], 175)


class CostModel(unittest.TestCase):
    def setUp(self):
        self.model = object.__new__(scaling.Model)
        self.model.__dict__.update(density=1e7, particle=5e-8, list=1e-9, contact=2e-8, across=0.3, pack=2e-9, bytes=72)
        self.network = {"latency": 1e-6, "bandwidth": 1e9, "reduction": 1e-6}

    def test_one_rank_only_computes(self):
        time, talk = self.model.time(1, (0.1, 0.1), (0, 0), 1, self.network)
        self.assertAlmostEqual(time, 1e5 * 5e-8)
        self.assertEqual(talk, 0)

    def test_ghosts_are_the_frame_around_a_column(self):
        r = scaling.REACH
        self.assertAlmostEqual(self.model.ghosts((0.1, 0.2), (1, 0)), 1e7 * r * 0.2)
        self.assertAlmostEqual(self.model.ghosts((0.1, 0.2), (2, 2)), 1e7 * (2 * r * (0.1 + 0.2) + 4 * r * r))

    def test_a_message_costs_latency_and_its_bytes(self):
        ghosts = self.model.ghosts((0.1, 0.1), (1, 0))
        _, talk = self.model.time(2, (0.1, 0.1), (1, 0), 1, self.network)
        self.assertAlmostEqual(talk, 1e-6 + 72 * ghosts / 1e9, places=9)

    def test_a_reduction_counts_where_it_takes_longer_than_the_messages(self):
        _, talk = self.model.time(1024, (0.1, 0.1), (1, 0), 1, {**self.network, "reduction": 1e-3})
        self.assertAlmostEqual(talk, 10 * 1e-3, places=9)

    def test_efficiency_begins_at_one_falls_and_ends_where_a_column_is_narrower_than_the_reach(self):
        of = [figure.value for figure in scaling.predictions(self.model, "strong", lambda ranks: 1e5, 1)]
        self.assertAlmostEqual(of[0], 100)
        possible = [value for value in of if value == value]
        self.assertEqual(possible, sorted(possible, reverse=True))
        self.assertLess(len(possible), len(of))

    def test_columns_are_as_square_as_the_ranks_allow(self):
        self.assertEqual([scaling.cuts(ranks) for ranks in (1, 2, 12, 10000)], [(1, 1), (1, 2), (3, 4), (100, 100)])


if __name__ == "__main__":
    unittest.main()
