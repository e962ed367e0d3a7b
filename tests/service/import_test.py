"""Checkpoints that come from outside: a good one becomes a job that goes on with the same bits; a hostile one is refused with its
reason, and the server lives."""
import pathlib
import shutil
import tempfile
import unittest

import bedflow
import h5py
import numpy as np
from bedflow.checksum import crc32c
from bedflow.v1 import service_pb2
from crafted_checkpoint import manifest_entries, places, seal_again
from real_server import RealServer, bed


def setUpModule():
    global server, connection, job, good, scratch
    server = unittest.enterModuleContext(RealServer())
    connection = unittest.enterModuleContext(server.connect())
    scratch = pathlib.Path(unittest.enterModuleContext(tempfile.TemporaryDirectory()))
    job = connection.submit(bed(), ranks=2, checkpoint_every=0.005).wait(60)
    good = job.download(scratch / "good.h5", step=job.checkpoints()[1].step)


def import_call():
    return connection._connection.stub.ImportCheckpoint


class Good(unittest.TestCase):
    def test_it_goes_on_with_the_same_bits(self):
        imported = connection.import_checkpoint(good)
        self.assertEqual(imported.state, "SUSPENDED")
        self.assertEqual(imported.message.spec.ranks, 2)
        self.assertEqual(imported.verify(), [])
        imported.resume().wait(60)
        step = job.checkpoints()[0].step
        self.assertEqual(imported.checkpoints()[0].step, step)
        with h5py.File(server.checkpoint(job, step)) as ours, h5py.File(server.checkpoint(imported, step)) as theirs:
            def same(name, entry):
                if isinstance(entry, h5py.Dataset) and name != "manifest":
                    np.testing.assert_array_equal(entry[()], theirs[name][()], err_msg=name)
            ours.visititems(same)

    def test_one_of_a_single_rank(self):
        alone = connection.submit(bed(end=0.002), ranks=1).wait(60)
        imported = connection.import_checkpoint(alone.download(scratch / "alone.h5"))
        self.assertEqual(imported.message.spec.ranks, 1)
        step = imported.checkpoints()[0].step
        with h5py.File(server.checkpoint(alone, step)) as ours, h5py.File(server.checkpoint(imported, step)) as theirs:
            self.assertEqual(ours.attrs["ranks"], theirs.attrs["ranks"])
            np.testing.assert_array_equal(ours["particles/position"][()], theirs["particles/position"][()])

    def test_others_start_from_it_with_recorded_changes(self):
        imported = connection.import_checkpoint(good)
        case = imported.case()
        case.time.end = 0.006
        started = connection.submit(case, start_from=imported, ranks=1).wait(60)
        self.assertEqual([(one.path, one.to) for one in started.message.overrides], [("time.end", "0.006 s")])
        self.assertEqual(started.message.start_from_job, imported.id)
        self.assertAlmostEqual(started.progress.time, 0.006, 9)

    def test_the_same_request_gives_the_same_job(self):
        def parts():
            data = good.read_bytes()
            head = service_pb2.ImportCheckpointRequest.Head(bytes=len(data), request_id="the-same-import-1")
            yield service_pb2.ImportCheckpointRequest(head=head)
            yield service_pb2.ImportCheckpointRequest(offset=0, data=data, crc32c=crc32c(data))
        self.assertEqual(*(connection._connection.call(import_call(), parts()).id for _ in range(2)))

    def test_the_client_prints_the_id(self):
        done = server.client("checkpoint", "import", good, "--ranks", "1", "--label", "from=elsewhere")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = connection.job(done.stdout.strip())
        self.assertEqual((found.state, found.message.spec.ranks, found.message.spec.labels["from"]), ("SUSPENDED", 1, "elsewhere"))


class Hostile(unittest.TestCase):
    def setUp(self):
        self.file = scratch / "hostile.h5"
        shutil.copy(good, self.file)
        self.jobs = sum(1 for _ in connection.jobs())

    def tearDown(self):
        self.assertEqual(sum(1 for _ in connection.jobs()), self.jobs)
        self.assertIsNone(server.process.poll())
        self.assertEqual(list((server.path / "data/drafts").iterdir()), [])

    def refused(self, reason, *texts):
        with self.assertRaises(bedflow.Error) as caught:
            connection.import_checkpoint(self.file)
        self.assertEqual(caught.exception.reason, reason, caught.exception)
        self.last = str(caught.exception)
        for text in texts:
            self.assertIn(text, self.last)

    def change(self, name, change):
        with h5py.File(self.file, "r+") as file:
            values = file[name][()]
            change(values)
            file[name][...] = values
        seal_again(self.file)

    def replace(self, name, create, size=None):
        """Another dataset of that name. size: the bytes that the manifest says it has."""
        before = {entry: (place, length) for entry, place, length in manifest_entries(self.file)}
        with h5py.File(self.file, "r+") as file:
            del file[name]
            create(file)
        now = places(self.file)
        entries = []
        for entry, (place, length) in before.items():
            if entry == name and size is not None:
                entries.append((entry, *size))
            else:
                entries.append((entry, *now.get(entry, (place, length))))
        seal_again(self.file, entries)

    def test_sealing_again_changes_nothing_by_itself(self):
        seal_again(self.file)
        self.assertEqual(self.file.read_bytes(), good.read_bytes())

    def test_what_is_no_checkpoint(self):
        self.file.write_bytes(b"#!/bin/sh\n" * 200)
        self.refused("CHECKPOINT_CORRUPT", "not a checkpoint of bedflow")
        self.file.write_bytes(b"short")
        self.refused("BAD_UPLOAD", "bytes is 5")
        self.file.write_bytes(bytes(4096))
        self.refused("CHECKPOINT_CORRUPT", "all zeros")
        with h5py.File(self.file, "w") as file:
            file["x"] = np.zeros(1000)
        self.refused("CHECKPOINT_CORRUPT", "no seal")

    def test_cut_and_flipped(self):
        data = good.read_bytes()
        self.file.write_bytes(data[:len(data) // 2])
        self.refused("CHECKPOINT_CORRUPT")
        place = places(good)["particles/velocity"][0] + 100
        self.file.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1:])
        self.refused("CHECKPOINT_CORRUPT", "particles/velocity block 0: checksum")

    def test_a_shape_beyond_all_memory(self):
        def huge(file):
            space = h5py.h5s.create_simple((1 << 61, 3))
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_layout(h5py.h5d.CONTIGUOUS)
            properties.set_alloc_time(h5py.h5d.ALLOC_TIME_LATE)
            h5py.h5d.create(file.id, b"particles/position", h5py.h5t.NATIVE_DOUBLE, space, properties)
        try:
            self.replace("particles/position", huge, (512, 24))
        except Exception:  # HDF5 itself may refuse 2^61 rows: then as many as it takes
            shutil.copy(good, self.file)
            self.replace("particles/position", lambda file: file.create_dataset("particles/position", (1 << 40, 3), "f8"), (512, 24))
        self.refused("CHECKPOINT_CORRUPT", "particles/position")

    def test_files_of_others(self):
        self.replace("particles/velocity", lambda file: file.__setitem__("particles/velocity", h5py.ExternalLink("/etc/passwd", "/x")))
        self.refused("CHECKPOINT_CORRUPT", "particles/velocity")
        shutil.copy(good, self.file)
        outside = scratch / "outside"
        outside.write_bytes(bytes(12000))
        self.replace("particles/velocity",
                     lambda file: file.create_dataset("particles/velocity", (500, 3), "f8", external=[(str(outside), 0, 12000)]))
        self.refused("CHECKPOINT_CORRUPT", "particles/velocity")
        shutil.copy(good, self.file)
        self.replace("particles/velocity", lambda file: file.__setitem__("particles/velocity", h5py.SoftLink("/particles/position")))
        self.refused("CHECKPOINT_CORRUPT", "particles/velocity")

    def test_chunks_and_filters_and_other_types(self):
        for options in ({"chunks": (50, 3), "compression": "gzip"}, {"dtype": ">f8"}, {"dtype": "f4"}):
            shutil.copy(good, self.file)
            settings = {"dtype": "f8", **options}
            self.replace("particles/velocity",
                         lambda file, settings=settings: file.create_dataset("particles/velocity", data=np.zeros((500, 3)), **settings))
            self.refused("CHECKPOINT_CORRUPT", "particles/velocity")

    def test_lies_in_the_manifest(self):
        entries = manifest_entries(self.file)
        seal_again(self.file, [(name, entries[0][1], size) if name == "particles/position" else (name, place, size)
                               for name, place, size in entries])
        self.refused("CHECKPOINT_CORRUPT")
        shutil.copy(good, self.file)
        swapped = {"particles/position": "../../etc/passwd  "[:18]}
        seal_again(self.file, [(swapped.get(name, name).replace(" ", "x"), place, size) for name, place, size in entries])
        self.refused("CHECKPOINT_CORRUPT", "which is not in the file")

    def test_values_that_no_bed_has(self):
        for name, change, text in (
                ("particles/position", lambda v: v.__setitem__((3, 1), np.nan), "not finite"),
                ("particles/position", lambda v: v.__setitem__((3, 1), 1e9), "outside the box"),
                ("particles/velocity", lambda v: v.__setitem__((3, 1), np.inf), "not finite"),
                ("particles/id", lambda v: v.__setitem__(3, v[4]), "twice"),
                ("gas/fraction", lambda v: v.__setitem__((0, 0, 0), 0), "gas/fraction"),
                ("rank_offsets/particles/id", lambda v: v.__setitem__(1, 1 << 60), "rank_offsets/particles/id")):
            with self.subTest(name=name, text=text):
                shutil.copy(good, self.file)
                self.change(name, change)
                self.refused("CHECKPOINT_CORRUPT", text)

    def test_the_wrong_case(self):
        def write(text):
            shutil.copy(good, self.file)
            with h5py.File(self.file, "r+") as file:
                room = len(file["case"])
                file["case"][...] = np.frombuffer(text.ljust(room)[:room], dtype=np.uint8)
            seal_again(self.file)
        with h5py.File(good) as file:
            case = bytes(file["case"][()])
        write(case.replace(b"x: 0.024", b"x: 0.025"))
        self.refused("INVALID_CASE", "does not fit the case", "domain/size_x")
        write(case.replace(b"cells", b"tells"))
        self.refused("INVALID_CASE")
        write(case.replace(b"restitution: 0.9", b"restitution: 9.9"))
        self.refused("INVALID_CASE", "restitution")
        write(b"domain{" * 1000)
        self.refused("INVALID_CASE")
        seeding = case[case.index(b"random {"):case.index(b"symplectic_euler")]
        write(case.replace(seeding, b'placed { file: "/etc/passwd" }'.ljust(len(seeding))))
        self.refused("INVALID_CASE", "particles.placed.file")
        self.assertNotIn("line 1", self.last)  # the table was not opened

    def test_numbers_of_another_bed(self):
        for name, value, reason in (("particles/count", 499.0, "INVALID_CASE"), ("domain/size_y", 1.0, "INVALID_CASE"),
                                    ("particles/total_mass", np.nan, "CHECKPOINT_CORRUPT")):
            shutil.copy(good, self.file)
            with h5py.File(self.file, "r+") as file:
                file.attrs.modify(name, value)
            seal_again(self.file)
            self.refused(reason, name)


class Uploads(unittest.TestCase):
    def refused(self, reason, *messages):
        with self.assertRaises(bedflow.Error) as caught:
            connection._connection.call(import_call(), iter(messages))
        self.assertEqual(caught.exception.reason, reason, caught.exception)
        return caught.exception

    def test_that_break_their_own_word(self):
        Part, Head = service_pb2.ImportCheckpointRequest, service_pb2.ImportCheckpointRequest.Head
        data = good.read_bytes()
        head = Part(head=Head(bytes=len(data)))
        self.refused("BAD_UPLOAD")
        self.refused("BAD_UPLOAD", Part(offset=0, data=data, crc32c=crc32c(data)))
        self.refused("BAD_UPLOAD", head)
        self.refused("BAD_UPLOAD", head, head)
        self.refused("BAD_UPLOAD", head, Part(offset=7, data=data, crc32c=crc32c(data)))
        self.refused("BAD_UPLOAD", head, Part(offset=0, data=data, crc32c=1))
        self.refused("BAD_UPLOAD", head, Part(offset=0, data=data[:-1], crc32c=crc32c(data[:-1])))
        self.refused("BAD_UPLOAD", head, Part(offset=0, data=data + b"x", crc32c=crc32c(data + b"x")))
        self.refused("BAD_UPLOAD", Part(head=Head(bytes=1 << 60)))
        self.refused("DISK_FULL", Part(head=Head(bytes=1 << 39)))
        bad = Head(bytes=len(data))
        bad.spec.ranks = 10 ** 6
        self.assertIn("spec.ranks", str(self.refused("INVALID_CASE", Part(head=bad), Part(offset=0, data=data, crc32c=crc32c(data)))))
        self.assertEqual(list((server.path / "data/drafts").iterdir()), [])


if __name__ == "__main__":
    unittest.main()
