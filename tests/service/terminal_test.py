"""The client at a real terminal: watch, top and completion as a user meets them; real server, real engine."""
import csv
import io
import json
import os
import shutil
import subprocess
import termios
import time
import unittest

from real_server import BIN, RealServer, bed, wait_until
from terminal import Session


def setUpModule():
    global server, job
    server = unittest.enterModuleContext(RealServer("--housekeeping-seconds", "0.2"))
    job = server.submitted("--checkpoint-steps", 20, end=100)
    assert wait_until(lambda: "RUNNING" in server.client("get", job).stdout)


def at_terminal(*words, **options):
    return Session([BIN / "bedflow", *words, "--server", server.address], **options)


class Watch(unittest.TestCase):
    def test_it_outlives_the_server_and_ctrl_c_leaves_the_job_alone(self):
        with at_terminal("watch", job) as session:
            session.expect(r"RUNNING.*\[.*%.*step \d+")
            server.kill()
            session.expect("connection to the server is lost.*the job is not touched")
            server.start()
            session.expect("connected again")
            session.expect(r"%.*step \d+")
            session.type("\x03")
            session.expect(f"come back: bedflow watch {job} --server {server.address}")
            self.assertEqual(session.end(), 130)
        self.assertIn("RUNNING", server.client("get", job).stdout)

    def test_a_narrow_terminal_is_not_overflowed(self):
        with at_terminal("watch", job, columns=40) as session:
            session.expect(r"%")
            session.text = ""
            for _ in range(20):
                session.read(0.1)
            bars = [part.split("\n")[0] for part in session.text.split("\r\033[K") if "%" in part]
            self.assertTrue(bars)
            self.assertLessEqual(max(map(len, bars)), 39)


class Top(unittest.TestCase):
    def test_it_follows_the_jobs_and_leaves_the_terminal_as_it_was(self):
        with at_terminal("top", "--interval", "0.2") as session:
            session.expect(r"\033\[\?1049h")
            first = session.frame(lambda lines: any(job in line and " s/s" in line and "MiB" in line for line in lines))
            self.assertEqual(len(first), 30)
            self.assertIn("1 running", first[0])
            self.assertIn("q: quit", first[-1])
            line = next(line for line in first if job in line)
            session.frame(lambda lines: any(job in one and one != line for one in lines))  # it moves on
            session.resize(60, 10)
            small = session.frame(lambda lines: len(lines) == 10)
            self.assertEqual([line for line in small if len(line) > 60], [])
            session.type("q")
            session.expect(r"\033\[\?25h\033\[\?1049l")
            self.assertEqual(session.end(), 0)
            self.assertEqual(termios.tcgetattr(session.terminal), session.settings)

    def test_ctrl_c_ends_it_and_all_jobs_are_shown_on_demand(self):
        done = server.submitted()
        server.client("wait", done)
        with at_terminal("top", "--interval", "0.2") as session:
            session.frame(lambda lines: any(job in line for line in lines) and not any(done in line for line in lines))
            session.type("a")
            session.frame(lambda lines: any(done in line and "SUCCEEDED" in line for line in lines))
            session.type("\x03")
            self.assertEqual(session.end(), 0)
            self.assertEqual(termios.tcgetattr(session.terminal), session.settings)

    def test_a_server_that_goes_away_is_waited_for(self):
        with at_terminal("top", "--interval", "0.2") as session:
            session.frame(lambda lines: any(job in line for line in lines))
            server.kill()
            session.frame(lambda lines: "away" in lines[1])
            server.start()
            session.frame(lambda lines: "away" not in lines[1] and any(job in line for line in lines))
            session.type("q")
            self.assertEqual(session.end(), 0)

    def test_once_it_is_a_table_or_data(self):
        self.assertIn(job, server.client("top", "--once").stdout)
        row = next(row for row in csv.DictReader(io.StringIO(server.client("top", "-o", "csv").stdout)) if row["job"] == job)
        self.assertEqual(row["state"], "RUNNING")
        self.assertGreater(float(row["speed"]), 0)
        self.assertGreater(int(row["memory"]), 1e6)
        self.assertEqual([one["job"] for one in json.loads(server.client("top", "-o", "json").stdout)], [job])


class Completion(unittest.TestCase):
    @staticmethod
    def candidates(line, address=None):
        answer = subprocess.run([BIN / "bedflow", "__complete", line, "--server", address or server.address], capture_output=True, text=True,
                                timeout=20)
        assert answer.returncode == 0 and answer.stderr == "", answer
        return [one.split("\t")[0] for one in answer.stdout.splitlines()]

    def test_it_knows_verbs_options_and_what_the_server_has(self):
        self.assertEqual(self.candidates("bedflow wat"), ["watch"])
        self.assertIn("--history", self.candidates("bedflow watch --h"))
        self.assertIn(job, self.candidates("bedflow get j-"))
        self.assertEqual(self.candidates("bedflow list -o cs"), ["csv"])
        self.assertEqual(self.candidates("bedflow list --state RUNN"), ["RUNNING"])
        self.assertEqual(self.candidates("bedflow list --output=js"), ["--output=json", "--output=jsonl"])
        self.assertEqual(self.candidates("bedflow init muel"), ["mueller"])
        self.assertIn("mueller", self.candidates("bedflow submit "))
        self.assertEqual(self.candidates("bedflow submit ")[-1], ":files")
        self.assertIn("bed_height", self.candidates(f"bedflow stats {job} "))
        self.assertIn("usage", self.candidates("bedflow server "))
        self.assertEqual(self.candidates(f"bedflow get {job} "), [])
        self.assertEqual(self.candidates("bedflow reproduce goldschmidt-2"), ["goldschmidt-2"])
        self.assertIn("substeps", self.candidates("bedflow study mueller --vary sub"))
        self.assertEqual([one for one in self.candidates("bedflow study ") if one in ("mueller", "list")], ["mueller", "list"])
        self.assertTrue(wait_until(lambda: self.candidates(f"bedflow checkpoint get {job}@")))
        self.assertTrue(all(one.startswith(f"{job}@") for one in self.candidates(f"bedflow checkpoint get {job}@")))

    def test_without_a_server_it_is_silent_and_quick(self):
        begin = time.monotonic()
        self.assertEqual(self.candidates("bedflow get j-", "unix:/nonexistent/socket"), [])
        self.assertLess(time.monotonic() - begin, 1)  # an order above what a user waits for: the machine may be busy

    def test_bash_completes_jobs_and_checkpoints(self):
        self.complete_in("bash", ["bash", "--norc", "--noprofile", "-i"], "source <(bedflow completion bash)")

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh_completes_jobs_and_checkpoints(self):
        self.complete_in("zsh", ["zsh", "-f", "-i"], "autoload -U compinit; compinit -u -D; source <(bedflow completion zsh)")

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish_completes_jobs_and_checkpoints(self):
        answer = subprocess.run(["fish", "--no-config", "-c", f"bedflow completion fish | source; complete -C 'bedflow get j-'"],
                                capture_output=True, text=True, timeout=60, env=self.environment())
        self.assertIn(job, answer.stdout, answer.stderr)

    @staticmethod
    def environment():
        return dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}", BEDFLOW_SERVER=server.address, HOME=str(server.path))

    def complete_in(self, name, shell, setup):
        self.assertTrue(wait_until(lambda: self.candidates(f"bedflow checkpoint get {job}@")))
        with Session(shell, columns=200, **self.environment() | {"PS1": "> "}) as session:
            session.type(f"{setup}; echo read''y\n")
            session.expect("ready\r\n")
            session.type("bedflow pi\t")  # begins one verb
            session.expect_words("pin ")
            session.type(f"{job[:5]}\t")  # the only job that begins so
            session.expect_words(f"{job} ")
            session.type("\x15")
            session.type(f"bedflow checkpoint verify {job}@\t\t")
            session.expect_words(f"{job}@.*?\\d+")
            session.type("\x15exit\n")
            self.assertEqual(session.end(), 0, name)


if __name__ == "__main__":
    unittest.main()
