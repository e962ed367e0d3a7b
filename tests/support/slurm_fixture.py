"""Tests of jobs under a Slurm of their own: one Slurm for the tests of a program, a server for each test."""
import os
import unittest

from bedflow.v1 import job_pb2
from real_server import RealServer, wait_until
from slurm_cluster import SlurmCluster, missing_programs

FAKE = """
name: "fake"
description: "{asks}"
domain {{ size {{ x: 0.1 y: 0.1 z: 0.1 }} cells {{ x: 4 y: 4 z: 4 }} }}
gravity {{ y: -9.81 }}
gas {{ density: 1.2 viscosity: 1.8e-5 simple {{}} upwind {{}} }}
time {{ step: 0.01 end: {end} }}
"""


def fake_case(steps, asks="step_ms=5"):
    """So many steps of the fake engine; asks as in tests/service/fake_engine.cpp. Checkpoints every 10 steps."""
    return FAKE.format(asks=asks, end=0.01 * steps)


class SlurmTest(unittest.TestCase):
    cluster = None
    engine = ("--engine", os.environ["BEDFLOW_FAKE_ENGINE"])
    flags = ()

    @classmethod
    def setUpClass(cls):
        if missing := missing_programs():
            raise unittest.SkipTest(f"Slurm is not installed here: {', '.join(missing)} (Debian: slurm-wlm, slurm-client, munge)")
        if SlurmTest.cluster is None:
            SlurmTest.cluster = SlurmCluster()
            os.environ.update({name: value for name, value in SlurmTest.cluster.environment().items() if name in ("SLURM_CONF", "PATH")})
            unittest.addModuleCleanup(SlurmTest.end_cluster)

    @staticmethod
    def end_cluster():
        if SlurmTest.cluster:
            SlurmTest.cluster.close()
        SlurmTest.cluster = None

    def setUp(self):
        self.cluster.free_node()
        self.server = RealServer("--slurm", "--slurm-poll-seconds", "0.2", *self.engine, *self.flags)
        self.addCleanup(self._end)
        self.bedflow = self.server.connect()

    def _end(self):
        self.bedflow.close()
        self.cluster.cancel_all()
        self.server.__exit__()

    def submit(self, case, **options):
        return self.bedflow.submit(case, executor="slurm", checkpoint_every=options.pop("checkpoint_every", 0.1), **options)

    def wait_for(self, job, state, seconds=30):
        if not wait_until(lambda: job.refresh().state == state, seconds):
            self.fail(f"{job.message}\n{self.server_log()}\n{self.cluster.logs()}")
        return job

    def wait_for_step(self, job, step):
        self.assertTrue(wait_until(lambda: job.refresh().progress.step >= step), f"{job.message}\n{self.server_log()}")

    def server_log(self):
        return (self.server.path / "server.log").read_text()[-4000:]

    def slurm_jobs(self, job):
        """Numbers of those in Slurm that are attempts at the job, in order of the attempts."""
        return [number for number, name, _ in sorted(self.cluster.jobs(), key=lambda one: int(one[0])) if f"-{job.id}-" in name]

    def starts(self, job):
        """(attempt, step) at which its engines have started."""
        return [(event.epoch, event.started.step) for event in self.bedflow.job(job.id).watch() if event.HasField("started")]

    def assert_not_doubled(self, job):
        self.assertFalse((self.server.folder(job) / "doubled").exists(), "two engines ran at once")

    def first_starts(self, job, count):
        found = []
        for event in self.bedflow.job(job.id).watch():
            if event.HasField("started"):
                found.append((event.epoch, event.started.step))
            if len(found) == count:
                break
        return found

    def reason(self, job):
        return job_pb2.StopReason.Name(job.refresh().message.reason)
