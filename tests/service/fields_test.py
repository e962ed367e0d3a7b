"""Fields and particles of checkpoints, asked of the real server: against the files as h5py reads them."""
import csv
import io
import json
import unittest

import bedflow
import h5py
import numpy as np
from real_server import RealServer, bed


def setUpModule():
    global server, connection, job, newest
    server = unittest.enterModuleContext(RealServer())
    connection = unittest.enterModuleContext(server.connect())
    job = connection.submit(bed(), ranks=2, checkpoint_every=0.005).wait(60)
    newest = job.checkpoints()[0].step


def stored(name, step=None):
    with h5py.File(server.checkpoint(job, newest if step is None else step)) as file:
        return file[name][()]


class Slices(unittest.TestCase):
    def test_a_slice_is_the_layer_of_the_checkpoint(self):
        for axis, index in (("x", np.s_[:, :, 5]), ("y", np.s_[:, 2, :]), ("z", np.s_[3, :, :])):
            with self.subTest(axis=axis):
                size, cells, layer = {"x": (0.024, 8, 5), "y": (0.048, 16, 2), "z": (0.01, 4, 3)}[axis]
                field = job.slice("pressure", "gas_fraction", axis=axis, at=(layer + 0.3) * size / cells)
                np.testing.assert_array_equal(field.values["pressure"], stored("gas/pressure")[index])
                np.testing.assert_array_equal(field.values["gas_fraction"], stored("gas/fraction")[index])
                self.assertAlmostEqual(field.place, (layer + 0.5) * size / cells, 15)
                self.assertEqual(field.step, newest)
                self.assertNotIn(axis, field.axes)

    def test_velocities_are_the_means_of_the_faces(self):
        faces = stored("gas/velocity_y")
        mean = 0.5 * (faces[:, :-1, :] + faces[:, 1:, :])
        field = job.slice("gas_velocity_y", "gas_speed", axis="z", at=0)
        np.testing.assert_array_equal(field.values["gas_velocity_y"], mean[0])
        self.assertTrue((field.values["gas_speed"] >= np.abs(mean[0])).all())

    def test_a_region_takes_the_cells_with_their_centres_in_it(self):
        field = job.slice("gas_fraction", axis="z", x=(0.003, 0.015), y=(None, 0.01))
        np.testing.assert_allclose(field.axes["x"], [0.0045, 0.0075, 0.0105, 0.0135])
        self.assertEqual(field.values["gas_fraction"].shape, (3, 4))
        np.testing.assert_array_equal(field.values["gas_fraction"], stored("gas/fraction")[2, :3, 1:5])

    def test_solids_in_cells_are_those_of_numpy(self):
        x, v = stored("particles/position"), stored("particles/velocity")
        cell = np.minimum((x / [0.003, 0.003, 0.0025]).astype(int), [7, 15, 3])
        inside = cell[:, 2] == 1
        number = np.zeros((16, 8))
        np.add.at(number, (cell[inside, 1], cell[inside, 0]), 1)
        field = job.slice("particle_number", "granular_temperature", axis="z", at=0.003)
        np.testing.assert_array_equal(field.values["particle_number"], number)
        j, i = np.unravel_index(number.argmax(), number.shape)
        own = v[inside & (cell[:, 1] == j) & (cell[:, 0] == i)]
        self.assertAlmostEqual(field.values["granular_temperature"][j, i], ((own - own.mean(0)) ** 2).sum() / (3 * len(own)), 12)
        self.assertTrue(np.isnan(field.values["granular_temperature"][number == 0]).all())


class Sums(unittest.TestCase):
    def test_the_integral_of_the_solids_is_the_volume_of_the_particles(self):
        found = job.reduce("solids_fraction", "particle_volume")
        volume = 500 * np.pi / 6 * 1.2e-3 ** 3
        self.assertAlmostEqual(found["solids_fraction"].integral / volume, 1, 12)  # sums of 512 cells: round-off
        self.assertAlmostEqual(found["particle_volume"].integral / volume, 1, 12)
        self.assertEqual(found["solids_fraction"].integral_unit, "m³")
        self.assertAlmostEqual(found["solids_fraction"].weight, 0.024 * 0.048 * 0.01, 15)

    def test_two_halves_are_the_whole_also_where_they_cut_cells(self):
        cut = 0.0101
        halves = [job.reduce("solids_fraction", "particle_kinetic_energy", y=part) for part in ((None, cut), (cut, None))]
        whole = job.reduce("solids_fraction", "particle_kinetic_energy")
        for name, all_of_it in whole.items():
            self.assertAlmostEqual(sum(half[name].integral for half in halves) / all_of_it.integral, 1, 12)

    def test_kinetic_energy_is_that_of_the_monitor(self):
        series = job.statistics("kinetic_energy")["kinetic_energy"]
        self.assertEqual(series.step[-1], newest)
        self.assertAlmostEqual(job.reduce("particle_kinetic_energy")["particle_kinetic_energy"].integral / series.value[-1], 1, 12)

    def test_a_histogram_is_that_of_numpy(self):
        found = job.reduce("particle_speed", bins=12)["particle_speed"]
        speed = np.linalg.norm(stored("particles/velocity"), axis=1)
        counts, edges = np.histogram(speed, 12)
        np.testing.assert_allclose(found.histogram * 500, counts, atol=1e-9)
        np.testing.assert_allclose(found.edges, edges, rtol=1e-14)
        self.assertAlmostEqual(found.deviation, speed.std(), 12)
        self.assertEqual((found.minimum, found.maximum), (speed.min(), speed.max()))

    def test_a_region_without_particles_has_no_mean(self):
        found = job.reduce("particle_speed", y=(0.045, None))["particle_speed"]
        self.assertTrue(np.isnan(found.mean))
        self.assertEqual(found.weight, 0)


class Profiles(unittest.TestCase):
    def test_a_profile_of_cells_is_the_mean_of_the_layers(self):
        field = job.profile("gas_fraction", axis="y")
        np.testing.assert_allclose(field.values["gas_fraction"], stored("gas/fraction").mean(axis=(0, 2)), rtol=1e-13)
        np.testing.assert_array_equal(field.values["gas_fraction_maximum"], stored("gas/fraction").max(axis=(0, 2)))
        self.assertEqual(len(field.axes["y"]), 16)

    def test_a_profile_of_particles_is_the_mean_of_the_bins(self):
        x, v = stored("particles/position")[:, 1], stored("particles/velocity")[:, 1]
        bins = np.minimum((x / (0.048 / 10)).astype(int), 9)
        field = job.profile("particle_velocity_y", axis="y", bins=10)
        counts = np.bincount(bins, minlength=10)
        np.testing.assert_array_equal(field.values["particle_velocity_y_count"], counts)
        np.testing.assert_allclose(field.values["particle_velocity_y"][counts > 0],
                                   (np.bincount(bins, v, 10) / np.maximum(counts, 1))[counts > 0], rtol=1e-12)
        self.assertTrue(np.isnan(field.values["particle_velocity_y"][counts == 0]).all())


class Samples(unittest.TestCase):
    def test_a_sample_has_the_particles_values_and_follows_them(self):
        ids, x = stored("particles/id"), stored("particles/position")
        field = job.sample(most=40, seed=7)
        self.assertEqual(len(field.values["particle_id"]), 40)
        self.assertEqual(field.particles, 500)
        rows = {number: row for row, number in enumerate(ids)}
        chosen = [rows[int(number)] for number in field.values["particle_id"]]
        np.testing.assert_array_equal(field.values["particle_y"], x[chosen, 1])
        earlier = job.sample(most=40, seed=7, step=job.checkpoints()[-1].step)
        np.testing.assert_array_equal(earlier.values["particle_id"], field.values["particle_id"])
        other = job.sample(most=40, seed=8)
        self.assertLess(len(np.intersect1d(other.values["particle_id"], field.values["particle_id"])), 20)

    def test_a_sample_of_more_than_there_are_is_all(self):
        field = job.sample("particle_id", "particle_x", most=10 ** 6, x=(None, 0.012))
        self.assertEqual(field.particles, (stored("particles/position")[:, 0] < 0.012).sum())
        self.assertTrue((field.values["particle_x"] < 0.012).all())


class Refusals(unittest.TestCase):
    def refused(self, reason, *words, **options):
        with self.assertRaises(bedflow.Error) as caught:
            job.slice(*words, **options)
        self.assertEqual(caught.exception.reason, reason)
        return caught.exception

    def test_questions_without_sense_are_refused_with_value_and_range(self):
        self.assertIn("gas_fraction", self.refused("BAD_REQUEST", "void").message)
        self.assertIn("particle_speed is of particles", self.refused("BAD_REQUEST", "particle_speed").message)
        self.assertIn("0.01", self.refused("BAD_REQUEST", at=1.0).message)
        self.refused("BAD_REQUEST", at=float("nan"))
        self.assertIn("0.024", self.refused("BAD_REQUEST", x=(0.5, 0.6)).message)
        self.refused("BAD_REQUEST", x=(0.02, 0.01))
        self.refused("BAD_REQUEST", *["gas_fraction"] * 65)
        self.refused("BAD_REQUEST", "q" * 20000)
        self.refused("CHECKPOINT_NOT_FOUND", step=123456)
        self.refused("WRONG_STATE", fresh=True)
        with self.assertRaises(bedflow.Error) as caught:
            bedflow.Job(job._connection, "j-000000000000").slice()
        self.assertEqual(caught.exception.reason, "JOB_NOT_FOUND")


class Client(unittest.TestCase):
    def test_its_tables_have_the_values(self):
        done = server.client("field", "slice", job.id, "pressure", "--axis", "z", "--at", "0.001", "-o", "csv")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = list(csv.DictReader(io.StringIO(done.stdout)))
        self.assertEqual(list(rows[0]), ["y_m", "x_m", "pressure"])
        values = np.array([float(row["pressure"]) for row in rows]).reshape(16, 8)
        np.testing.assert_array_equal(values, stored("gas/pressure")[0])
        found = json.loads(server.client("field", "slice", job.id, "pressure", "--at", "0.001", "-o", "json").stdout)
        np.testing.assert_array_equal(np.array(found["values"]["pressure"]), values)
        lines = server.client("field", "sample", job.id, "--most", "5", "-o", "jsonl").stdout.splitlines()
        self.assertEqual(len(lines), 5)
        self.assertIn("particle_x", json.loads(lines[0]))

    def test_a_folder_gives_the_same_as_the_server(self):
        words = ["field", "profile", "gas_fraction", "--axis", "y", "-o", "csv"]
        asked = server.client(*words[:2], job.id, *words[2:])
        read = server.client(*words[:2], server.folder(job), *words[2:])
        self.assertEqual(asked.stdout, read.stdout)
        self.assertEqual(len(read.stdout.splitlines()), 17)

    def test_it_ends_with_the_code_of_what_is_wrong(self):
        for words, code, text in ((["slice", job.id, "void"], 2, "gas_fraction"), (["slice", "j-000000000000"], 5, "bedflow list"),
                                  (["reduce", job.id, "--x", "1"], 2, "LOW:HIGH"), (["slice", job.id, "--step", "77"], 5, "step 77"),
                                  (["sample", job.id, "--fresh"], 6, "SUCCEEDED")):
            with self.subTest(words=words):
                done = server.client("field", *words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(text, done.stderr)
                self.assertEqual(done.stdout, "")

    def test_reduce_shows_sums_and_histograms(self):
        rows = list(csv.DictReader(io.StringIO(server.client("field", "reduce", job.id, "solids_fraction", "-o", "csv").stdout)))
        self.assertAlmostEqual(float(rows[0]["integral"]) / (500 * np.pi / 6 * 1.2e-3 ** 3), 1, 12)
        rows = list(csv.DictReader(io.StringIO(
            server.client("field", "reduce", job.id, "particle_speed", "--histogram", "4", "-o", "csv").stdout)))
        self.assertAlmostEqual(sum(float(row["share"]) for row in rows), 1, 12)


if __name__ == "__main__":
    unittest.main()
