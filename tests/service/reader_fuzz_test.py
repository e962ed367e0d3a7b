"""bedflow-reader against checkpoints whose metadata was changed at random, every checksum mended: HDF5 sees what nobody meant.
It may refuse, or end by a signal; it may not hang, and what it takes must be good."""
import collections
import pathlib
import random
import subprocess
import tempfile
import unittest

from crafted_checkpoint import manifest_entries, mend, metadata_blocks, places, seal_by_hand
from real_server import BIN, bed

ROUNDS = 1500


class Random(unittest.TestCase):
    def test_changes_end_in_a_refusal_or_a_good_checkpoint(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "case.txtpb").write_text(bed(end=0.002))
        subprocess.run([BIN / "bedflow-engine", folder], check=True, capture_output=True)
        good = max((folder / "checkpoints").iterdir())
        data, entries, known = good.read_bytes(), manifest_entries(good), places(good)
        blocks = metadata_blocks(data)
        self.assertGreater(len(blocks), 30)
        spots = [spot for place, length in blocks for spot in range(place + 4, place + length)]
        chance = random.Random(2024)
        ends = collections.Counter()
        for round_number in range(ROUNDS):
            changed = bytearray(data)
            for _ in range(chance.choice((1, 2, 8))):
                changed[chance.choice(spots)] = chance.choice((0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)))
            mend(changed, blocks)
            file = folder / "changed.h5"
            file.write_bytes(seal_by_hand(changed, entries, known["manifest"]))
            into = folder / f"job{round_number}"
            (into / "checkpoints").mkdir(parents=True)
            done = subprocess.run([BIN / "bedflow-reader", "--seconds", "10", "--memory-mib", "512", "import", file, into],
                                  capture_output=True, timeout=30)
            ends[done.returncode] += 1
            if done.returncode == 0:
                made = max((into / "checkpoints").iterdir())
                verified = subprocess.run([BIN / "bedflow-reader", "verify", made], capture_output=True, text=True, timeout=30)
                self.assertEqual((verified.returncode, verified.stdout), (0, ""))
            else:
                self.assertIn(done.returncode, (10, 14, 20, 70, -6, -11, -8), done.stderr)
                self.assertTrue(done.stderr or done.returncode < 0)
        print(dict(ends))
        self.assertGreater(ends[0], 0)  # a time of last access, say, is nobody's business


if __name__ == "__main__":
    unittest.main()
