"""An upgrade with running jobs, and a backup from which an empty machine goes on: the real server and the real engine."""
import json
import pathlib
import shutil
import sqlite3
import subprocess
import tempfile
import unittest

from real_server import BIN, RealServer, bed, wait_until


def shown(server, job):
    answer = server.client("get", job, "-o", "json")
    assert answer.returncode == 0, answer.stderr + (server.path / "server.log").read_text()[-2000:]
    return json.loads(answer.stdout)


def backup(data, to):
    return subprocess.run([BIN / "bedflowd", "backup", "--data", data, "--to", to], capture_output=True, text=True, timeout=60)


def as_version_2(catalogue):
    """The catalogue as a server of before owners and tokens has left it."""
    with sqlite3.connect(catalogue) as database:
        database.executescript("""
          PRAGMA foreign_keys=OFF;
          ALTER TABLE jobs RENAME TO newer;
          CREATE TABLE jobs (number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, state INTEGER NOT NULL,
                             retries INTEGER NOT NULL, from_step INTEGER, job BLOB NOT NULL);
          INSERT INTO jobs SELECT number, id, state, retries, from_step, job FROM newer;
          ALTER TABLE submissions RENAME TO newer_submissions;
          CREATE TABLE submissions (number INTEGER PRIMARY KEY REFERENCES jobs (number), request_id TEXT UNIQUE, content BLOB NOT NULL);
          INSERT INTO submissions SELECT number, request_id, content FROM newer_submissions;
          DROP TABLE newer_submissions;
          DROP TABLE newer;
          CREATE INDEX jobs_by_state ON jobs (state, number);
          PRAGMA user_version = 2;
        """)
        others = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
                  if name not in ("jobs", "submissions") and not name.startswith("sqlite_")]
        for name in others:
            database.execute(f"DROP TABLE {name}")
    database.close()


class Upgrade(unittest.TestCase):
    def test_the_new_server_takes_up_the_running_engines_on_the_old_catalogue(self):
        with RealServer("--slots", "1") as server:
            job = server.submitted(end=100)
            waiting = server.submitted()
            self.assertTrue(wait_until(lambda: int(shown(server, job).get("progress", {}).get("step", 0)) > 5))
            server.stop()
            before = int(shown_from_folder(server, job))
            as_version_2(server.path / "data/catalogue.sqlite")
            self.assertTrue(wait_until(lambda: int(shown_from_folder(server, job)) > before))  # it runs on without any server
            server.start()
            now = shown(server, job)
            self.assertEqual((now["state"], now["epoch"]), ("RUNNING", 1))
            self.assertEqual(shown(server, waiting)["state"], "PENDING")
            with sqlite3.connect(server.path / "data/catalogue.sqlite") as database:
                self.assertGreater(database.execute("PRAGMA user_version").fetchone()[0], 2)
            database.close()
            server.client("suspend", job)
            server.client("wait", job, "--timeout", 30)
            now = shown(server, job)
            self.assertEqual((now["state"], now["epoch"]), ("STATE_SUSPENDED", 1))
            self.assertEqual(server.client("wait", waiting, "--timeout", 50).returncode, 0)

    def test_an_older_server_leaves_a_newer_catalogue_alone(self):
        with RealServer() as server:
            server.stop()
            with sqlite3.connect(server.path / "data/catalogue.sqlite") as database:
                database.execute("PRAGMA user_version = 1000")
            database.close()
            with self.assertRaisesRegex(RuntimeError, "written by a newer bedflowd"):
                server.start()
            with sqlite3.connect(server.path / "data/catalogue.sqlite") as database:
                database.execute("PRAGMA user_version = 3")
            database.close()


def shown_from_folder(server, job):
    """The newest step that the engine has told, straight from the folder."""
    answer = server.client("logs", server.path / "data/jobs" / job, "--all", "-o", "jsonl")
    steps = [json.loads(line)["progress"].get("step", 0) for line in answer.stdout.splitlines() if "progress" in line]
    return steps[-1] if steps else 0


class Backup(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="bedflow-backup-"))
        self.addCleanup(shutil.rmtree, self.path)

    def test_a_running_server_is_copied_and_an_empty_machine_goes_on_from_the_copy(self):
        with RealServer() as server:
            done = server.submitted()
            self.assertEqual(server.client("wait", done, "--timeout", 50).returncode, 0)
            running = server.submitted("--checkpoint-steps", 5, end=100)
            self.assertTrue(wait_until(lambda: int(shown(server, running).get("progress", {}).get("step", 0)) > 20))
            first = backup(server.path / "data", self.path / "copy")
            self.assertEqual(first.returncode, 0, first.stderr)
            self.assertIn("2 jobs", first.stdout)
            self.assertTrue(wait_until(lambda: int(shown(server, running)["progress"]["step"]) > 40))
            second = backup(server.path / "data", self.path / "copy")  # what has not changed is not copied again
            self.assertEqual(second.returncode, 0, second.stderr)
            self.assertLess(int(second.stdout.split()[2]), int(first.stdout.split()[2]))
            results = server.client("stats", done, "-o", "csv").stdout
        # The first machine is gone, with all that ran on it.
        with RealServer() as empty:
            empty.stop()
            shutil.rmtree(empty.path / "data")
            shutil.copytree(self.path / "copy", empty.path / "data")
            empty.start()
            self.assertEqual(empty.client("stats", done, "-o", "csv").stdout, results)
            self.assertEqual(shown(empty, done)["state"], "SUCCEEDED")
            # It was running when it was copied: it is taken up from the newest checkpoint of the copy, without being asked.
            self.assertTrue(wait_until(lambda: [shown(empty, running)[key] for key in ("epoch", "state")] == [2, "RUNNING"]))
            started = [json.loads(line)["started"] for line in empty.client("logs", running, "-o", "jsonl").stdout.splitlines()
                       if '"started"' in line]
            self.assertGreaterEqual(int(started[-1]["step"]), 20)
            empty.client("suspend", running)
            empty.client("wait", running, "--timeout", 30)
            for step in [one["step"] for one in json.loads(empty.client("checkpoint", "list", running, "-o", "json").stdout)]:
                verified = empty.client("checkpoint", "verify", f"{running}@{step}")
                self.assertEqual(verified.returncode, 0, verified.stderr + (empty.path / "server.log").read_text()[-2000:])

    def test_what_is_deleted_goes_from_the_copy_and_links_stay_links(self):
        with RealServer() as server:
            gone, kept = server.submitted(), server.submitted()
            for job in (gone, kept):
                server.client("wait", job, "--timeout", 50)
            step = json.loads(server.client("checkpoint", "list", kept, "-o", "json").stdout)[0]["step"]
            self.assertEqual(server.client("pin", f"{kept}@{step}").returncode, 0)
            self.assertEqual(backup(server.path / "data", self.path / "copy").returncode, 0)
            self.assertTrue((self.path / "copy/jobs" / gone).exists())
            name = f"checkpoint_{int(step):010d}.h5"
            self.assertEqual((self.path / "copy/jobs" / kept / "pinned" / name).stat().st_nlink, 2)
            server.client("delete", "--yes", gone)
            self.assertEqual(backup(server.path / "data", self.path / "copy").returncode, 0)
            self.assertFalse((self.path / "copy/jobs" / gone).exists())
            self.assertTrue((self.path / "copy/jobs" / kept / "checkpoints" / name).exists())

    def test_a_copy_is_made_only_where_it_harms_nothing(self):
        with RealServer() as server:
            for data, to, words in ((self.path, self.path / "copy", "no data folder"), (server.path / "data", server.path / "data", "itself"),
                                    (server.path / "data", server.path, "neither empty nor an earlier backup")):
                answer = backup(data, to)
                self.assertEqual(answer.returncode, 2, answer.stderr)
                self.assertIn(words, answer.stderr)


if __name__ == "__main__":
    unittest.main()
