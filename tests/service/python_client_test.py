"""The Python client's own promises on the real server: jobs, watching, statistics as arrays, and the example."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import bedflow
import numpy as np
from bedflow.checksum import crc32c
from real_server import RealServer, bed, wait_until


def setUpModule():
    global server, connection, job
    server = unittest.enterModuleContext(RealServer())
    connection = unittest.enterModuleContext(server.connect())
    job = connection.submit(bed(end=0.02, interval=0.0001), ranks=2, labels={"study": "one"}).wait(60)


class Checksum(unittest.TestCase):
    def test_is_that_of_rfc_3720(self):
        for data, known in ((b"", 0), (b"123456789", 0xE3069283), (bytes(32), 0x8A9136AA), (b"\xff" * 32, 0x62A8AB43),
                            (bytes(range(32)), 0x46DD794E)):
            self.assertEqual(crc32c(data), known)


class Jobs(unittest.TestCase):
    def test_states_labels_and_lists(self):
        self.assertTrue(job.has_ended)
        self.assertEqual(job.state, "SUCCEEDED")
        self.assertIn(job.id, [one.id for one in connection.jobs(["SUCCEEDED"], {"study": "one"})])
        self.assertEqual(list(connection.jobs(labels={"study": "two"})), [])
        self.assertEqual(connection.job(job.id).case().particles.random.count, 500)

    def test_what_else_a_job_may_ask_for_is_text_of_its_message(self):
        other = connection.submit(bed(end=0.002), spec="checkpoints { keep: 4 when_disk_full: GO_ON } retries { most: 0 }").wait(60)
        self.assertEqual(other.message.spec.checkpoints.keep, 4)
        self.assertEqual(other.message.spec.checkpoints.when_disk_full, 1)
        self.assertEqual(other.message.spec.retries.most, 0)

    def test_a_case_is_text_a_file_or_a_message(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "case.txtpb"
            path.write_text(bed())
            self.assertEqual(bedflow.read_case(path), bedflow.read_case(bed()))
            self.assertEqual(bedflow.read_case(str(path)), bedflow.read_case(bed()))
        self.assertEqual(connection.plan(bed()).particles, 500)

    def test_every_fault_of_a_case_is_told(self):
        case = bedflow.read_case(bed())
        case.particles.diameter = -1
        case.time.end = 0
        with self.assertRaises(bedflow.Error) as caught:
            connection.submit(case)
        self.assertEqual(caught.exception.reason, "INVALID_CASE")
        self.assertLessEqual({"particles.diameter", "time.end"}, {fault.path for fault in caught.exception.faults})

    def test_no_server_is_an_error_of_its_own(self):
        with bedflow.connect("unix:/nowhere/bedflowd.sock") as nobody, self.assertRaises(bedflow.Error) as caught:
            nobody.info()
        self.assertEqual(caught.exception.reason, "UNAVAILABLE")

    def test_a_watch_goes_on_with_the_next_server_and_misses_nothing(self):
        with RealServer() as other, other.connect() as there:
            watched = there.submit(bed(end=0.03), checkpoint_every=0.002)
            seen = []
            for event in watched.watch():
                seen.append(event.sequence)
                if len(seen) == 3:
                    other.kill()
                    other.start()
            self.assertEqual(watched.state, "SUCCEEDED")
            self.assertEqual(seen, list(range(1, len(seen) + 1)))
            self.assertEqual(seen[-1], watched.refresh().message.last_sequence)

    def test_suspend_resume_cancel(self):
        long = connection.submit(bed(end=100))
        self.assertTrue(wait_until(lambda: long.refresh().progress.step > 0))
        long.suspend()
        self.assertEqual(long.wait(30).state, "SUSPENDED")
        long.resume(ranks=2)
        self.assertTrue(wait_until(lambda: long.refresh().state == "RUNNING"))
        long.cancel(skip_checkpoint=True)
        self.assertEqual(long.wait(30).state, "CANCELLED")
        with self.assertRaises(TimeoutError):
            endless = connection.submit(bed(end=100))
            self.addCleanup(endless.cancel, skip_checkpoint=True)
            endless.wait(0.3)


class Statistics(unittest.TestCase):
    def test_are_arrays(self):
        self.assertEqual(job.series_names(), ["kinetic_energy", "bed_height"])
        series = job.statistics()["kinetic_energy"]
        self.assertEqual(series.unit, "J")
        self.assertGreater(len(series.time), 100)
        self.assertTrue((np.diff(series.step.astype(int)) > 0).all())
        self.assertEqual(len(series.minimum), 0)

    def test_of_a_range_are_those_of_the_whole(self):
        whole = job.statistics("bed_height")["bed_height"]
        part = job.statistics("bed_height", time_range=(0.005, 0.01))["bed_height"]
        inside = (whole.time >= 0.005) & (whole.time <= 0.01)
        np.testing.assert_array_equal(part.value, whole.value[inside])
        with self.assertRaises(bedflow.Error) as caught:
            job.statistics("height_of_bed")
        self.assertEqual(caught.exception.reason, "SERIES_NOT_FOUND")
        self.assertIn("bed_height", caught.exception.message)

    def test_thinned_keep_minimum_maximum_and_mean(self):
        whole = job.statistics("kinetic_energy")["kinetic_energy"]
        thin = job.statistics("kinetic_energy", most=16)["kinetic_energy"]
        self.assertEqual(len(thin.value), 16)
        groups = np.split(whole.value, np.cumsum(thin.samples)[:-1])
        np.testing.assert_array_equal(thin.minimum, [group.min() for group in groups])
        np.testing.assert_array_equal(thin.maximum, [group.max() for group in groups])
        np.testing.assert_allclose(thin.value, [group.mean() for group in groups], rtol=1e-14)

    def test_are_followed_over_the_death_of_the_server(self):
        with RealServer() as other, other.connect() as there:
            followed = there.submit(bed(end=0.03, interval=0.0002), checkpoint_every=0.002)
            seen = []
            for name, step, when, value in followed.follow_statistics("bed_height"):
                self.assertEqual(name, "bed_height")
                seen.append((step, when, value))
                if len(seen) == 20:
                    other.kill()
                    other.start()
            whole = followed.statistics("bed_height")["bed_height"]
            self.assertEqual(seen, list(zip(whole.step, whole.time, whole.value, strict=True)))

    def test_the_client_lists_bounds_and_follows_them(self):
        done = server.client("stats", job.id, "bed_height", "--samples", "--from-step", "10", "--to-step", "20", "-o", "csv")
        steps = [int(line.split(",")[1]) for line in done.stdout.splitlines()[1:]]
        self.assertTrue(steps and min(steps) >= 10 and max(steps) <= 20, done.stdout)
        done = server.client("stats", job.id, "--list", "-o", "csv")
        self.assertEqual([line.split(",")[0] for line in done.stdout.splitlines()], ["name", "kinetic_energy", "bed_height"])
        done = server.client("stats", job.id, "bed_height", "--follow", "-o", "csv")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), 1 + len(job.statistics()["bed_height"].time))
        self.assertEqual(server.client("stats", job.id, "no_such", "--follow").returncode, 5)


class Example(unittest.TestCase):
    def test_draws_a_running_bed(self):
        with tempfile.TemporaryDirectory() as folder:
            case, picture = pathlib.Path(folder) / "case.txtpb", pathlib.Path(folder) / "bed.png"
            case.write_text(bed())
            script = pathlib.Path(__file__).resolve().parents[2] / "client/python/examples/plot_running_bed.py"
            done = subprocess.run([sys.executable, "-B", script, case, "--server", server.address, "--out", picture, "--every", "0.1"],
                                  capture_output=True, text=True, timeout=60, env={**os.environ, "MPLCONFIGDIR": folder})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.splitlines()[-1], "SUCCEEDED")
            try:
                import matplotlib  # noqa: F401
            except ImportError:
                self.assertIn("mean gas fraction", done.stderr)
            else:
                self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main()
