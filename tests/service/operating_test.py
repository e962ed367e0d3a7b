"""What an operator relies on, on the real server and the real engine: metrics, usage, quotas, the reserve, retention, pins, the log."""
import http.client
import json
import re
import socket
import subprocess
import unittest

from real_server import BIN, RealServer, bed, wait_until


def get(path, target="/metrics", method="GET"):
    """Status and body of an answer over a Unix socket."""
    connection = http.client.HTTPConnection("metrics", timeout=10)
    connection.sock = socket.socket(socket.AF_UNIX)
    connection.sock.settimeout(10)
    connection.sock.connect(str(path))
    connection.request(method, target)
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body


def values(text):
    """{'name{labels}': value}; every line must be one that Prometheus takes."""
    found, types = {}, {}
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            name, kind = line.split()[2:]
            assert name not in types, f"{name} is told twice"
            types[name] = kind
        if line.startswith("#"):
            continue
        match = re.fullmatch(r'([a-z_]+)(\{[a-z]+="(?:[^"\\\n]|\\["\\n])*"(?:,[a-z]+="(?:[^"\\\n]|\\["\\n])*")*\})? (\S+)', line)
        assert match, line
        family = re.sub(r"_(bucket|sum|count)$", "", match[1])
        assert match[1] in types or types.get(family) == "histogram", f"{match[1]} has no type"
        found[match[1] + (match[2] or "")] = float(match[3])
    return found


def case_file(server, **options):
    file = server.path / "case.txtpb"
    file.write_text(bed(**options))
    return file


def submitted(server, *options, **case):
    answer = server.client("submit", case_file(server, **case), *options)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.strip()


def run_to_end(server, *options, **case):
    job = submitted(server, *options, **case)
    answer = server.client("wait", job, "--timeout", 50)
    assert answer.returncode == 0, answer.stderr
    return job


def shown(server, job):
    answer = server.client("get", job, "-o", "json")
    assert answer.returncode == 0, answer.stderr + (server.path / "server.log").read_text()[-2000:]
    return json.loads(answer.stdout)


def steps_of(server, job):
    return [int(one.get("step", 0)) for one in json.loads(server.client("checkpoint", "list", job, "-o", "json").stdout)]


class Metrics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = cls.enterClassContext(RealServer("--housekeeping-seconds", "0.1"))
        cls.socket = cls.server.path / "data/metrics.sock"
        cls.job = run_to_end(cls.server)

    def test_they_count_jobs_calls_and_disk(self):
        status, text = get(self.socket)
        self.assertEqual(status, 200)
        told = values(text)
        self.assertEqual(told['bedflow_jobs{state="SUCCEEDED"}'], 1)
        self.assertEqual(told['bedflow_jobs{state="FAILED"}'], 0)
        self.assertGreaterEqual(told['bedflow_job_transitions_total{state="RUNNING"}'], 1)
        created = told['bedflow_calls_total{method="CreateJob",code="OK"}']
        self.assertGreaterEqual(created, 1)
        self.assertEqual(told['bedflow_call_seconds_bucket{method="CreateJob",le="+Inf"}'], created)
        self.assertEqual(told['bedflow_call_seconds_count{method="CreateJob"}'], created)
        self.assertGreater(told["bedflow_disk_free_bytes"], 0)
        self.assertGreater(told["process_resident_memory_bytes"], 1e6)

        def is_right():
            folder = sum(file.stat().st_size for file in (self.server.path / "data/jobs").rglob("*") if file.is_file())
            used = [value for name, value in values(get(self.socket)[1]).items() if name.startswith("bedflow_disk_used_bytes")]
            return sum(used) == folder

        self.assertTrue(wait_until(is_right))

    def test_a_refused_call_is_counted_by_its_status(self):
        self.server.client("get", "j-000000000000")
        told = values(get(self.socket)[1])
        self.assertGreaterEqual(told['bedflow_calls_total{method="GetJob",code="NOT_FOUND"}'], 1)

    def test_what_is_no_question_for_metrics_is_refused(self):
        self.assertEqual(get(self.socket, "/else")[0], 404)
        self.assertEqual(get(self.socket, method="POST")[0], 405)
        with socket.socket(socket.AF_UNIX) as raw:
            raw.settimeout(10)
            raw.connect(str(self.socket))
            raw.sendall(b"\x00\xff no http at all\r\n\r\n")
            self.assertIn(b"400", raw.recv(64))
        self.assertEqual(get(self.socket)[0], 200)

    def test_silent_readers_do_not_keep_others_out(self):
        silent = []
        for _ in range(17):  # one more than are answered at once
            one = socket.socket(socket.AF_UNIX)
            one.connect(str(self.socket))
            silent.append(one)
        self.assertEqual(get(self.socket)[0], 200)  # once the first of them have had their time, 5 s
        for one in silent:
            one.close()

    def test_a_running_job_is_told_by_progress_time_left_and_memory(self):
        job = submitted(self.server, end=100)
        told = {}

        def is_told():
            told.update(values(get(self.socket)[1]))
            return told.get(f'bedflow_job_memory_bytes{{job="{job}",case="small-bed",owner="local"}}', 0) > 1e6

        self.assertTrue(wait_until(is_told), told)
        self.assertTrue(wait_until(lambda: [one for one in values(get(self.socket)[1]) if one.startswith("bedflow_job_progress_ratio")]))
        self.server.client("cancel", job, "--skip-checkpoint")

    def test_beyond_this_machine_only_when_it_is_said(self):
        answer = subprocess.run([BIN / "bedflowd", "--data", self.server.path / "other", "--metrics", "0.0.0.0:0"], capture_output=True,
                                text=True, timeout=20)
        self.assertEqual(answer.returncode, 2)
        self.assertIn("--metrics-beyond-loopback", answer.stderr)


class Limits(unittest.TestCase):
    def test_a_quota_of_jobs_names_itself_and_exits_nine(self):
        with RealServer("--quota", "each:jobs=1") as server:
            job = run_to_end(server)
            answer = server.client("submit", case_file(server))
            self.assertEqual(answer.returncode, 9, answer.stderr)
            for words in ("QUOTA", "may keep 1 jobs, and 1 are there", "bedflow server usage", "bedflow delete"):
                self.assertIn(words, answer.stderr)
            self.assertEqual(server.client("delete", "--yes", job).returncode, 0)
            submitted(server)

    def test_a_quota_of_disk_names_itself_and_exits_nine(self):
        with RealServer("--quota", "all:disk=100KiB", "--housekeeping-seconds", "0.1") as server:
            run_to_end(server)
            answers = []

            def is_refused():
                answers.append(server.client("submit", case_file(server)))
                return answers[-1].returncode == 9

            self.assertTrue(wait_until(is_refused), answers[-1].stderr)
            self.assertIn("may fill 100.0 KiB of the disk", answers[-1].stderr)

    def test_a_quota_of_running_jobs_makes_others_wait_and_says_so(self):
        with RealServer("--quota", "each:running=1", "--slots", "4") as server:
            first, second = submitted(server, end=100), submitted(server, end=100)
            self.assertTrue(wait_until(lambda: shown(server, first)["state"] == "RUNNING"))
            self.assertTrue(wait_until(lambda: "quota of running jobs" in shown(server, second).get("waits_for", "")))
            self.assertEqual(shown(server, second)["state"], "PENDING")
            server.client("cancel", first, "--skip-checkpoint")
            self.assertTrue(wait_until(lambda: shown(server, second)["state"] == "RUNNING"))
            self.assertNotIn("waits_for", shown(server, second))

    def test_below_the_reserve_no_job_starts(self):
        with RealServer("--disk-reserve", "900000TiB") as server:
            job = submitted(server)
            self.assertTrue(wait_until(lambda: "the reserve is" in shown(server, job).get("waits_for", "")))
            self.assertIn("the reserve is", server.client("get", job).stdout)
            self.assertEqual(shown(server, job)["state"], "PENDING")

    def test_a_quota_that_is_none_is_refused_at_the_start(self):
        for quota, words in (("each:jobs=many", "no whole number"), ("disk=1", "each:, all: or owner/NAME:"), ("all:disk=5 parsecs", "50GiB")):
            with self.subTest(quota=quota):
                answer = subprocess.run([BIN / "bedflowd", "--data", "/nonexistent/x", "--quota", quota], capture_output=True, text=True,
                                        timeout=20)
                self.assertEqual(answer.returncode, 2, answer.stderr)
                self.assertIn(words, answer.stderr)


class Usage(unittest.TestCase):
    def test_it_tells_disk_time_and_memory_by_job_and_owner(self):
        with RealServer() as server:
            done = run_to_end(server, "--checkpoint-every", 0.004)
            running = submitted(server, end=100)
            self.assertTrue(wait_until(lambda: shown(server, running)["state"] == "RUNNING"))
            usage = {}

            def has_memory():
                usage.update(json.loads(server.client("server", "usage", "-o", "json").stdout))
                return int(usage.get("memory_bytes", 0)) > 1e6

            self.assertTrue(wait_until(has_memory), usage)
            by_id = {one["id"]: one for one in usage["jobs"]}
            folder = server.path / "data/jobs" / done
            self.assertEqual(int(by_id[done]["bytes"]), sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()))
            self.assertEqual(int(by_id[done]["checkpoint_bytes"]), sum(file.stat().st_size for file in folder.glob("checkpoints/*")))
            self.assertEqual(by_id[done]["checkpoints"], 2)
            self.assertGreater(by_id[done]["rank_seconds"], 0)
            self.assertGreater(by_id[running]["rank_seconds"], 0)
            self.assertEqual(usage["jobs_running"], 1)
            self.assertEqual(sum(one["jobs"] for one in usage["owners"]), 2)
            table = server.client("server", "usage").stdout
            for word in ("disk in use", "CPU hours", done, running):
                self.assertIn(word, table)
            self.assertEqual(server.client("server", "usage", "--by-owner", "-o", "csv").stdout.splitlines()[0],
                             "owner,jobs,running,disk,cpu_hours,memory,quota")


class Policies(unittest.TestCase):
    def test_a_job_of_two_ranks_holds_what_its_options_say_and_one_of_them_writes(self):
        with RealServer() as server:
            job = run_to_end(server, "--ranks", 2, "--checkpoint-steps", 5, "--checkpoint-wall", "30min", "--retries", 4,
                             "--when-disk-full", "go-on", "--checkpoint-writers", "one-rank", end=0.004)
            spec = shown(server, job)["spec"]
            self.assertEqual(spec["retries"], {"most": 4})
            self.assertEqual({name: spec["checkpoints"][name] for name in ("every_wall_seconds", "when_disk_full", "writers")},
                             {"every_wall_seconds": 1800, "when_disk_full": "GO_ON", "writers": "ONE_RANK"})
            for step in steps_of(server, job):
                self.assertEqual(server.client("checkpoint", "verify", f"{job}@{step}").returncode, 0)
            refused = server.client("submit", "settling", "--checkpoint-wall", "soon")
            self.assertEqual(refused.returncode, 2)
            self.assertIn("soon is no time", refused.stderr)


class Retention(unittest.TestCase):
    def test_the_engine_keeps_what_the_policy_says_and_tells_what_it_removed(self):
        with RealServer() as server:
            job = run_to_end(server, "--checkpoint-steps", 1, "--keep", 2, "--keep-every", 4, end=0.004)
            steps = steps_of(server, job)
            events = [json.loads(line) for line in server.client("logs", job, "-o", "jsonl").stdout.splitlines()]
            written = [one["checkpoint"] for one in events if "checkpoint" in one]
            numbers = [int(one.get("step", 0)) for one in written]
            self.assertGreater(len(numbers), 12)
            every_fourth = numbers[3::4]
            self.assertEqual(sorted(steps), sorted(set(every_fourth) | set(numbers[-2:])))
            self.assertEqual([int(one.get("step", 0)) for one in written if one.get("stays")], every_fourth)
            removed = [int(step) for one in written for step in one.get("removed_steps", [])]
            self.assertEqual(sorted(removed + steps), sorted(numbers))
            self.assertIn("removed: step", server.client("logs", job).stdout)

    def test_the_engine_keeps_the_first_of_each_span_of_simulated_time(self):
        with RealServer() as server:
            job = run_to_end(server, "--checkpoint-steps", 1, "--keep-every-time", 0.002, end=0.01)
            checkpoints = json.loads(server.client("checkpoint", "list", job, "-o", "json").stdout)
            times = sorted(one["time"] for one in checkpoints if one.get("stays"))
            self.assertEqual([int(time / 0.002 * (1 + 1e-9)) for time in times], [1, 2, 3, 4, 5])

    def test_a_pinned_checkpoint_stays_and_so_does_a_pinned_job(self):
        with RealServer("--ended-days", "0.000001", "--housekeeping-seconds", "0.1") as server:
            job = submitted(server, "--checkpoint-steps", 1, end=100)
            self.assertTrue(wait_until(lambda: len(steps_of(server, job)) == 2))

            def is_pinned():  # the engine may remove it just then; then it is refused, never lost
                self.step = steps_of(server, job)[0]
                answer = server.client("pin", f"{job}@{self.step}")
                self.assertIn(answer.returncode, (0, 5), answer.stderr)
                return answer.returncode == 0

            self.assertTrue(wait_until(is_pinned))
            self.assertTrue(wait_until(lambda: steps_of(server, job)[-2] > self.step))
            self.assertEqual(steps_of(server, job)[-1], self.step)
            self.assertEqual(server.client("checkpoint", "verify", f"{job}@{self.step}").returncode, 0)
            server.client("cancel", job, "--skip-checkpoint")
            server.client("wait", job)
            answer = server.client("delete", "--yes", job)
            self.assertEqual(answer.returncode, 6)
            self.assertIn(f"bedflow unpin {job}@{self.step}", answer.stderr)
            server.client("pin", job)
            server.client("unpin", f"{job}@{self.step}")
            other = submitted(server)  # retention has had its rounds when this one is gone
            self.assertTrue(wait_until(lambda: server.client("get", other).returncode == 5))
            self.assertEqual(server.client("get", job).returncode, 0)
            server.client("unpin", job)
            self.assertTrue(wait_until(lambda: server.client("get", job).returncode == 5))

    def test_the_newest_good_checkpoint_of_a_job_that_can_be_resumed_stays(self):
        with RealServer("--ended-checkpoints", "1", "--ended-days", "0.000001", "--housekeeping-seconds", "3600") as server:
            job = submitted(server, "--checkpoint-steps", 1, "--keep", 4, end=100)
            self.assertTrue(wait_until(lambda: len(steps_of(server, job)) == 4))
            server.client("suspend", job)
            server.client("wait", job)
            steps = steps_of(server, job)
            for step in steps[:2]:
                file = server.path / "data/jobs" / job / f"checkpoints/checkpoint_{step:010d}.h5"
                content = bytearray(file.read_bytes())
                content[len(content) // 2] ^= 1
                file.write_bytes(content)
            server.kill()
            server.start()  # begins with a round
            self.assertTrue(wait_until(lambda: steps_of(server, job) == [steps[0], steps[2]]), (steps, steps_of(server, job)))
            told = server.client("logs", job).stdout
            self.assertIn(f"retention removed the checkpoints of steps {steps[3]}, {steps[1]}", told)
            usage = json.loads(server.client("server", "usage", "-o", "json").stdout)
            self.assertEqual(int(usage["removed_checkpoints"]), 2)
            self.assertEqual(server.client("resume", job).returncode, 0)
            self.assertTrue(wait_until(lambda: f"step {steps[2]}," in server.client("logs", job).stdout.split("retention removed")[1]))

    def test_jobs_that_ended_long_ago_go_and_those_that_can_be_resumed_stay(self):
        with RealServer("--ended-days", "0.00002", "--housekeeping-seconds", "0.1") as server:  # 1.7 s
            suspended = submitted(server, end=100)
            self.assertTrue(wait_until(lambda: steps_of(server, suspended)))
            server.client("suspend", suspended)
            done = run_to_end(server)
            self.assertTrue(wait_until(lambda: server.client("get", done).returncode == 5))
            self.assertFalse((server.path / "data/jobs" / done).exists())
            self.assertEqual(shown(server, suspended)["state"], "STATE_SUSPENDED")
            self.assertIn(f"{done} was removed by retention", (server.path / "server.log").read_text())


class Log(unittest.TestCase):
    def test_json_lines_say_when_how_bad_what_and_which_job(self):
        with RealServer("--log", "json") as server:
            job = run_to_end(server)
            lines = [json.loads(line) for line in (server.path / "server.log").read_text().splitlines()]
            of_job = [line for line in lines if line.get("job") == job]
            self.assertTrue([line for line in of_job if "SUCCEEDED" in line["message"]])
            for line in lines:
                self.assertRegex(line["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
                self.assertIn(line["level"], ("info", "warning", "error"))

    def test_options_come_from_a_file_and_the_command_line_goes_before_it(self):
        with RealServer() as other:  # for a folder of its own
            file = other.path / "bedflowd.conf"
            file.write_text('slots = 3\nquota = ["each:jobs=7", "all:jobs=9"]\n')
            with RealServer("--config", str(file), "--slots", "5") as server:
                usage = json.loads(server.client("server", "usage", "-o", "json").stdout)
                self.assertEqual(usage["slots"], 5)
                self.assertEqual(usage["quota"]["jobs"], 9)


if __name__ == "__main__":
    unittest.main()
