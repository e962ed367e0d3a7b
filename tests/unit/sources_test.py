"""Habits that clang-format and clang-tidy do not see: files with a duty in their name, on their first line, and of a size to read."""
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LONGEST = 400  # lines; about 300 is meant, and some tables are longer


def faults(path, text):
    """What is wrong with a source file, one line each."""
    found = []
    if re.search(r"util|helper|manager|impl\b|misc|common", path.stem):
        found.append("a name that does not tell what is inside")
    if not re.fullmatch(r"[a-z0-9_]+(\.grpc|\.pb)?", path.stem):
        found.append("file names are lower_case")
    lines = text.splitlines()
    if path.suffix == ".h" and not (lines and lines[0].startswith("// ") and "#pragma once" in lines):
        found.append("a header begins with a comment that says its duty, and has #pragma once")
    if len(lines) > LONGEST:
        found.append(f"{len(lines)} lines; split it by duty")
    if re.search(r"\b(TODO|FIXME|XXX|HACK)\b", text):
        found.append("a to-do")
    return found


def sources():
    for folder in ("engine", "proto", "server", "client", "tests"):
        yield from (p for p in sorted((ROOT / folder).rglob("*")) if p.suffix in (".h", ".cpp"))


class Sources(unittest.TestCase):
    def test_every_source_keeps_the_habits(self):
        listing = [f"{p.relative_to(ROOT)}: {fault}" for p in sources() for fault in faults(p, p.read_text())]
        self.assertEqual(listing, [])

    def test_a_bad_source_is_found(self):
        good = "// Duty.\n#pragma once\n"
        for name, text in [("pair_utils.h", good), ("PairList.h", good), ("a.h", "#pragma once\n"), ("a.h", "// Duty.\n"),
                           ("a.h", good + "\n" * LONGEST), ("a.h", good + "// TO" + "DO: later\n")]:
            self.assertEqual(len(faults(pathlib.Path(name), text)), 1, (name, text[:40]))
        self.assertEqual(faults(pathlib.Path("pair_list.h"), good), [])


class Scripts(unittest.TestCase):
    scripts = [*sorted((ROOT / "deploy").glob("*.sh")), ROOT / ".ci" / "run"]

    def test_each_parses_stops_at_an_error_and_can_be_run(self):
        for script in self.scripts:
            with self.subTest(script=script.name):
                subprocess.run(["bash", "-n", script], check=True)
                self.assertIn("\nset -euo pipefail\n", script.read_text())
                self.assertTrue(os.access(script, os.X_OK), "not executable")

    def test_install_names_what_is_missing_where_there_is_no_apt(self):
        """In an empty PATH with a dpkg-query that knows no package, the script must fail and name the packages."""
        with tempfile.TemporaryDirectory() as folder:
            for name in ("bash", "sed", "dirname"):
                os.symlink(subprocess.run(["which", name], capture_output=True, text=True, check=True).stdout.strip(),
                           pathlib.Path(folder) / name)
            query = pathlib.Path(folder) / "dpkg-query"
            query.write_text("#!/bin/bash\nexit 1\n")
            query.chmod(0o755)
            result = subprocess.run(["bash", ROOT / "deploy" / "install.sh"], env={"PATH": folder}, capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("apt-get", result.stderr)
        self.assertIn("libhdf5-openmpi-dev", result.stderr)


if __name__ == "__main__":
    unittest.main()
