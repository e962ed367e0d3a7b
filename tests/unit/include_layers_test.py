"""The tree keeps to its layers, and the check of that can fail."""
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import include_layers  # noqa: E402


class IncludeLayers(unittest.TestCase):
    def faults_of(self, source, text, others=()):
        """Faults of a tree of one source, and of empty headers beside it."""
        with tempfile.TemporaryDirectory() as folder:
            for name, content in [(source, text), *((other, "") for other in others)]:
                path = pathlib.Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(content)
            return include_layers.faults(folder)

    def assert_forbidden(self, source, include, *others):
        listing = self.faults_of(source, f"#pragma once\n#include {include}\n", others)
        self.assertEqual(len(listing), 1, listing)
        self.assertTrue(listing[0].startswith(f"{source}:2: "), listing)

    def test_every_include_keeps_to_the_layers(self):
        self.assertEqual(include_layers.faults(ROOT), [])

    def test_a_planted_violation_is_found(self):
        for source, include, *others in [
            ("engine/gas/a.cpp", '"particles/dem.h"', "engine/particles/dem.h"),
            ("engine/particles/a.h", '"gas/simple.h"', "engine/gas/simple.h"),
            ("engine/base/a.h", '"grid/grid.h"', "engine/grid/grid.h"),
            ("engine/models/a.h", '"parallel/comm.h"', "engine/parallel/comm.h"),
            ("engine/grid/a.h", '"run.h"', "engine/run.h"),
            ("server/a.cpp", '"base/stop.h"', "engine/base/stop.h"),
            ("client/a.cpp", '"jobs.h"', "server/jobs.h"),
            ("proto/a.cpp", '"base/stop.h"', "engine/base/stop.h"),
            ("engine/grid/a.cpp", "<mpi.h>"),
            ("engine/parallel/decomposition.cpp", "<mpi.h>"),
            ("tests/unit/a.cpp", "<mpi.h>"),
            ("engine/run.cpp", "<hdf5.h>"),
            ("engine/simulation.cpp", "<google/protobuf/text_format.h>"),
            ("server/a.cpp", "<hdf5.h>"),
            ("client/a.cpp", "<sqlite3.h>"),
            ("engine/unheard_of/a.h", '"a2.h"', "engine/unheard_of/a2.h"),
        ]:
            with self.subTest(source=source, include=include):
                self.assert_forbidden(source, include, *others)

    def test_messages_are_known_in_one_folder_of_the_engine(self):
        for header, folder in [("case.pb.h", "case"), ("job.pb.h", "report"), ("results.pb.h", "report")]:
            line = f'#include "bedflow/v1/{header}"\n'
            self.assertEqual(self.faults_of(f"engine/{folder}/a.cpp", line), [])
            self.assertNotEqual(self.faults_of("engine/run.cpp", line), [])
            self.assertNotEqual(self.faults_of("engine/checkpoint/a.cpp", line), [])

    def test_what_is_allowed_is_not_found(self):
        self.assertEqual(self.faults_of("engine/coupling/a.cpp", '#include "gas/simple.h"\n#include "particles/dem.h"\n#include <vector>\n',
                                        ["engine/gas/simple.h", "engine/particles/dem.h"]), [])

    def test_an_empty_tree_is_a_fault(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertNotEqual(include_layers.faults(folder), [])


if __name__ == "__main__":
    unittest.main()
