"""Checkpoints looked at, verified, and carried away in parts, on the real server."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import bedflow
import h5py
from bedflow.checksum import crc32c
from bedflow.v1 import service_pb2
from real_server import BIN, CROWD, RealServer, bed


def setUpModule():
    global server, scratch
    server = unittest.enterModuleContext(RealServer())
    scratch = pathlib.Path(unittest.enterModuleContext(tempfile.TemporaryDirectory()))


class Checkpoints(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.connection = cls.enterClassContext(server.connect())
        cls.job = cls.connection.submit(CROWD).wait(60)
        cls.step = cls.job.checkpoints()[0].step
        cls.bytes = server.checkpoint(cls.job, cls.step).read_bytes()

    def tearDown(self):
        server.checkpoint(self.job, self.step).write_bytes(self.bytes)

    def flip(self, name):
        path = server.checkpoint(self.job, self.step)
        with h5py.File(path) as file:
            place = file[name].id.get_offset() + (1 << 20) + 5
        data = bytearray(self.bytes)
        data[place] ^= 1
        path.write_bytes(data)

    def parts(self, offset=0, seal=None, step=None):
        request = service_pb2.DownloadCheckpointRequest(name=service_pb2.CheckpointName(job=self.job.id, step=step), offset=offset,
                                                        seal=seal)
        return self.connection._connection.stream(self.connection._connection.stub.DownloadCheckpoint, request)

    def refused(self, reason, call):
        with self.assertRaises(bedflow.Error) as caught:
            call()
        self.assertEqual(caught.exception.reason, reason)
        return caught.exception

    def test_a_good_one_has_no_faults_and_a_damaged_one_names_dataset_and_block(self):
        self.assertEqual(self.job.verify(), [])
        self.flip("particles/velocity")
        faults = self.job.verify()
        self.assertEqual(len(faults), 1)
        self.assertTrue(faults[0].startswith("particles/velocity block 1: checksum"), faults)
        done = server.client("checkpoint", "verify", f"{self.job.id}@{self.step}", "-o", "json")
        self.assertEqual(done.returncode, 11)
        self.assertEqual(json.loads(done.stdout)["faults"][0]["path"], "particles/velocity block 1")

    def test_questions_pass_over_a_damaged_one(self):
        self.flip("particles/position")
        earlier = self.job.checkpoints()[1].step
        self.assertEqual(self.job.reduce("particle_speed")["particle_speed"].weight, 64000)
        self.assertEqual(self.job.sample(most=1).step, earlier)
        error = self.refused("CHECKPOINT_CORRUPT", lambda: self.job.sample(most=1, step=self.step))
        self.assertIn("particles/position block 1", str(error))

    def test_what_one_holds_is_told(self):
        done = server.client("checkpoint", "get", self.job.id, "-o", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout)
        arrays = {one["name"]: one for one in found["content"]["arrays"]}
        self.assertEqual([int(one) for one in arrays["particles/position"]["shape"]], [64000, 3])
        self.assertEqual(arrays["particles/position"]["unit"], "m")
        self.assertEqual(found["content"]["numbers"]["particles/count"], 64000)
        self.assertIn("particle_speed", [one["name"] for one in found["content"]["quantities"]])
        self.assertNotIn("pressure", [one["name"] for one in found["content"]["quantities"]])  # no gas

    def test_a_download_is_the_file(self):
        self.assertEqual(self.job.download(scratch / "whole.h5").read_bytes(), self.bytes)
        for part in self.parts():
            self.assertEqual(crc32c(part.data), part.crc32c)
            self.assertLessEqual(len(part.data), 1 << 20)

    def test_a_download_goes_on_behind_what_is_there_also_on_the_next_server(self):
        stream = self.parts()
        first = next(stream)
        stream.close()
        self.assertEqual((first.step, first.bytes), (self.step, len(self.bytes)))
        server.kill()
        server.start()
        rest = list(self.parts(len(first.data), first.seal, first.step))
        self.assertGreater(len(rest), 2)
        self.assertEqual(first.data + b"".join(part.data for part in rest), self.bytes)
        self.assertEqual(list(self.parts(len(self.bytes), first.seal))[0].data, b"")

    def test_the_client_goes_on_where_it_stopped(self):
        out = scratch / "taken_up.h5"
        seal = next(self.parts()).seal
        out.with_name(out.name + ".part").write_bytes(self.bytes[:3_000_000])
        out.with_name(out.name + ".part.seal").write_text(f"{self.step} {seal}\n")
        done = server.client("checkpoint", "download", self.job.id, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("going on at byte 3000000", done.stderr)
        self.assertEqual(out.read_bytes(), self.bytes)
        self.assertEqual(sorted(path.name for path in scratch.glob("taken_up*")), ["taken_up.h5"])

    def test_another_file_is_not_mixed_with_what_is_there(self):
        out = scratch / "changed.h5"
        out.with_name(out.name + ".part").write_bytes(b"of another checkpoint")
        out.with_name(out.name + ".part.seal").write_text(f"{self.step} 00000000-1234567\n")
        done = server.client("checkpoint", "download", f"{self.job.id}@{self.step}", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("CHECKPOINT_CHANGED", done.stderr)
        self.assertEqual(out.read_bytes(), self.bytes)
        self.refused("CHECKPOINT_CHANGED", lambda: list(self.parts(5, "00000000-1234567")))
        self.refused("BAD_REQUEST", lambda: list(self.parts(len(self.bytes) + 1)))
        self.refused("CHECKPOINT_NOT_FOUND", lambda: list(self.parts(step=99)))

    def test_a_damaged_one_is_sent_and_told(self):
        self.flip("particles/position")
        done = server.client("checkpoint", "download", self.job.id, "-o", scratch / "damaged.h5")
        self.assertEqual(done.returncode, 11, done.stderr)
        self.assertIn("particles/position block 1", done.stderr)

    def test_a_reader_that_dies_has_not_found_damage(self):
        alone = pathlib.Path(tempfile.mkdtemp(dir=scratch))
        program, reader = pathlib.Path(shutil.copy(BIN / "bedflow", alone)), alone / "bedflow-reader"
        reader.write_text("#!/bin/sh\nkill -9 $$\n")
        reader.chmod(0o755)
        done = subprocess.run([program, "checkpoint", "download", self.job.id, "-o", alone / "bed.h5", "--server", server.address],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("is not verified: bedflow-reader ended by exit code 137", done.stderr)
        self.assertEqual((alone / "bed.h5").read_bytes(), self.bytes)


class Running(unittest.TestCase):
    def test_a_fresh_one_is_newer_than_the_question(self):
        connection = self.enterContext(server.connect())
        job = connection.submit(bed(end=100), ranks=1)
        self.addCleanup(job.cancel, skip_checkpoint=True)
        for event in job.watch():
            if event.HasField("progress") and event.progress.step > 5:
                before = event.progress.step
                break
        field = job.slice("gas_fraction", fresh=True)
        self.assertGreaterEqual(field.step, before)
        self.assertIn(field.step, [one.step for one in job.checkpoints()])
        with self.assertRaises(bedflow.Error) as caught:
            job.delete()
        self.assertEqual(caught.exception.reason, "WRONG_STATE")


class Deleting(unittest.TestCase):
    def setUp(self):
        self.connection = self.enterContext(server.connect())
        self.job = self.connection.submit(bed(end=0.001)).wait(60)

    def is_gone(self):
        with self.assertRaises(bedflow.Error) as caught:
            self.connection.job(self.job.id)
        self.assertEqual(caught.exception.reason, "JOB_NOT_FOUND")
        self.assertFalse(server.folder(self.job).exists())
        self.assertNotIn(self.job.id, [one.id for one in self.connection.jobs()])
        self.assertFalse((server.path / "data/removed" / self.job.id).exists())

    def test_takes_all_of_a_job_and_nothing_of_others(self):
        started = self.connection.submit(start_from=self.job).wait(60)
        self.assertGreater(self.job.delete(), 0)
        self.is_gone()
        self.assertEqual(started.verify(), [])

    def test_that_a_server_did_not_finish_the_next_one_finishes(self):
        server.kill()
        (server.path / "data/removed").mkdir(exist_ok=True)
        server.folder(self.job).rename(server.path / "data/removed" / self.job.id)
        server.start()
        self.is_gone()

    def test_asks_and_the_client_says_how(self):
        done = server.client("delete", self.job.id)
        self.assertEqual(done.returncode, 2)
        self.assertIn("bedflow delete --yes", done.stderr)
        self.assertEqual(self.connection.job(self.job.id).state, "SUCCEEDED")
        self.assertEqual(server.client("delete", "--yes", self.job.id).returncode, 0)
        self.is_gone()
        self.assertEqual(server.client("delete", "--yes", self.job.id).returncode, 5)


class Readers(unittest.TestCase):
    """The process that reads checkpoints, with every fault that it may have."""

    def reasons(self, script, *options):
        reader = scratch / "reader.sh"
        reader.write_text("#!/bin/bash\n" + script)
        reader.chmod(0o755)
        with RealServer("--reader", str(reader), *options) as other, other.connect() as connection:
            job = connection.submit(bed(end=0.0005)).wait(60)
            reasons = []
            for call in (job.slice, job.verify):
                try:
                    call()
                except bedflow.Error as error:
                    reasons.append(error.reason)
            self.assertIsNone(other.process.poll())
            self.assertEqual(job.refresh().state, "SUCCEEDED")
        return reasons

    def test_that_crashes(self):
        self.assertEqual(self.reasons("kill -SEGV $$\n"), ["READER_FAILED"] * 2)

    def test_that_hangs(self):
        self.assertEqual(self.reasons("exec sleep 1000\n", "--reader-seconds", "1"), ["TOO_MUCH"] * 2)

    def test_that_talks_without_end(self):
        self.assertEqual(self.reasons("exec yes\n", "--reader-seconds", "2")[0], "TOO_MUCH")  # a first length of 0x0a790a79

    def test_that_says_nonsense(self):
        self.assertIn(self.reasons("printf '\\x05\\x00\\x00\\x00hello'\n")[0], ("READER_FAILED", "BACKEND_ERROR"))

    def test_that_has_too_little_memory(self):
        with RealServer("--reader-memory-mib", "64") as other, other.connect() as connection:
            job = connection.submit(CROWD).wait(60)
            with self.assertRaises(bedflow.Error) as caught:
                job.sample(*["particle_x"] * 60, most=64000)
            self.assertIn(caught.exception.reason, ("TOO_MUCH", "BACKEND_ERROR"))


if __name__ == "__main__":
    unittest.main()
