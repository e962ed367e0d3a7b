"""What takes Slurm its time: wall limits, what stops a job, nodes that are lost or seem to be, a controller that is away or dies in the moment."""
import os
import signal
import unittest

from real_server import bed, wait_until
from slurm_fixture import SlurmTest, fake_case


class WallLimit(SlurmTest):
    engine = ()

    def test_slurms_signal_ends_the_real_engine_at_a_good_checkpoint(self):
        job = self.submit(bed(1000), ranks=2, wall_limit=60, checkpoint_every=1000)
        self.wait_for(job, "FAILED", 90)
        self.assertEqual(self.reason(job), "WALL_LIMIT")
        stopped = next(event.stopped for event in job.watch() if event.HasField("stopped"))
        newest = max(self.server.folder(job).glob("checkpoints/*.h5"))
        self.assertEqual(int(newest.stem.removeprefix("checkpoint_")), stopped.step)
        verified = self.server.client("checkpoint", "verify", job.id)
        self.assertEqual(verified.returncode, 0, verified.stderr)
        self.assertIn("the time is nearly over", (self.server.folder(job) / "attempts/1/stderr.log").read_text())


class Requeue(SlurmTest):
    def test_by_its_policy_it_goes_on_in_another_job_of_slurms(self):
        job = self.submit(fake_case(100_000), wall_limit=60, requeue=True)
        self.assertTrue(wait_until(lambda: job.refresh().message.epoch == 2 and job.state == "RUNNING", 90), job.message)
        self.assertEqual(len(self.slurm_jobs(job)), 2)
        self.assertEqual(job.message.retries, 0)
        stopped, started = None, None
        for event in job.watch():
            stopped = event.stopped.step if event.HasField("stopped") else stopped
            if event.HasField("started") and event.epoch == 2:
                started = event.started.step
                break
        self.assertEqual(started, stopped)
        self.assert_not_doubled(job)


class Moments(SlurmTest):
    def test_the_engine_of_a_node_that_only_seems_lost_is_fenced_off(self):
        job = self.submit(fake_case(100_000))
        self.wait_for_step(job, 15)
        self.cluster.stop("slurmd")  # the engine lives on
        engines = self.cluster.processes()
        self.assertTrue(engines)
        self.cluster.say("scontrol", "update", f"nodename={self.cluster.host}", "state=down", "reason=silent")
        self.assertTrue(wait_until(lambda: job.refresh().message.epoch == 2), self.server_log())
        self.assertTrue(wait_until(lambda: not (self.running_engines(job))), "the first engine runs on")
        self.cluster.return_node()
        self.assertTrue(wait_until(lambda: job.refresh().state == "RUNNING", 60), self.server_log())
        self.assert_not_doubled(job)

    def running_engines(self, job):
        found = []
        for process in self.cluster.processes():
            try:
                with open(f"/proc/{process}/cmdline", "rb") as file:
                    words = file.read().split(b"\0")
            except OSError:
                continue
            if words[0] == os.environ["BEDFLOW_FAKE_ENGINE"].encode():
                found.append(process)
        return found

    def test_a_controller_that_is_away_is_told_of_and_waited_for(self):
        job = self.submit(fake_case(60))
        self.wait_for_step(job, 1)
        self.cluster.stop("slurmctld", signal.SIGTERM)  # killed it might forget what it was told last
        try:
            later = self.submit(fake_case(5))
            self.assertTrue(wait_until(lambda: "Unable to contact" in later.refresh().message.waits_for), later.message)
            self.assertIn("Unable to contact", self.bedflow.info().executor_infos[1].trouble)
            self.assertIn("does not answer", self.server.client("server", "info").stdout)
        finally:
            self.cluster.start("slurmctld")
        self.wait_for(job, "SUCCEEDED", 60)
        self.wait_for(later, "SUCCEEDED", 60)
        self.assertEqual([len(self.slurm_jobs(one)) for one in (job, later)], [1, 1])
        self.assertEqual(self.bedflow.info().executor_infos[1].trouble, "")


class KilledController(SlurmTest):
    """On a Slurm of its own: it gives the numbers of forgotten jobs to later ones, of other tests too."""

    @classmethod
    def setUpClass(cls):
        cls.end_cluster()
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        cls.end_cluster()

    def wait_through(self, job):
        """To its end. A controller that has forgotten a job gives its number to the next one; Slurm then cancels that, and drains the
        node that knows the number. So an operator's help is allowed, but no second engine and no lost job."""
        def is_through():
            self.cluster.free_node()
            if job.refresh().state == "SUSPENDED":
                job.resume()
            return job.state == "SUCCEEDED"
        self.assertTrue(wait_until(is_through, 90), f"{job.message}\n{self.server_log()}")

    def test_a_controller_that_dies_within_moments_of_the_submission(self):
        for moment in range(4):
            with self.subTest(moment=moment):
                job = self.submit(fake_case(20))
                if moment:  # how far Slurm has come
                    wait_until(lambda: len(self.slurm_jobs(job)) == 1 and (moment < 2 or job.refresh().message.batch_job != ""), 5)
                if moment == 3:
                    wait_until(lambda: job.refresh().progress.step > 0, 5)
                self.cluster.stop("slurmctld", signal.SIGKILL)
                self.cluster.start("slurmctld")
                self.wait_through(job)
                self.assert_not_doubled(job)
                self.assertEqual(job.progress.step, 20)


class Stopping(SlurmTest):
    def test_what_slurm_does_not_take_fails_with_its_words(self):
        self.server.kill()
        self.server._options += ("--slurm-option=--partition=moon",)
        self.server.start()
        job = self.submit(fake_case(10))
        self.wait_for(job, "FAILED")
        self.assertEqual(self.reason(job), "BACKEND_ERROR")
        self.assertIn("invalid partition", job.message.message.lower())

    def test_a_frozen_engine_is_ended_and_tried_again(self):
        self.server.kill()
        self.server._options += ("--heartbeat-seconds", "2")
        self.server.start()
        job = self.submit(fake_case(40, "step_ms=2 freeze_at=25 epoch=1"))
        self.wait_for(job, "SUCCEEDED")
        self.assertEqual(self.starts(job), [(1, 0), (2, 20)])

    def test_one_that_somebody_cancels_in_slurm_is_suspended_and_can_go_on(self):
        job = self.submit(fake_case(100_000))
        self.wait_for_step(job, 25)
        self.cluster.say("scancel", job.message.batch_job)
        self.wait_for(job, "SUSPENDED")
        self.assertIn("not by this server", job.message.message)
        job.resume()
        self.wait_for(job, "RUNNING")
        self.assert_not_doubled(job)

    def test_suspended_and_resumed_it_goes_on_where_it_was(self):
        job = self.submit(fake_case(400))
        self.wait_for_step(job, 15)
        job.suspend()
        self.wait_for(job, "SUSPENDED")
        step = job.progress.step
        job.resume()
        self.wait_for_step(job, step + 1)
        self.assertEqual(self.first_starts(job, 2), [(1, 0), (2, step)])
        job.cancel()
        self.wait_for(job, "CANCELLED")


class Losses(SlurmTest):
    def test_a_node_that_is_lost_costs_what_came_after_the_newest_good_checkpoint(self):
        job = self.submit(fake_case(100_000))
        self.wait_for_step(job, 45)
        (self.server.checkpoint(job, 40)).write_text("torn")
        self.cluster.lose_node()
        self.assertTrue(wait_until(lambda: job.refresh().message.epoch == 2), self.server_log())
        self.assertIn(f"{job.id} is RECOVERING: Slurm's job {self.slurm_jobs(job)[0]} ended as NODE_FAIL", self.server_log())
        self.cluster.return_node()
        self.wait_for(job, "RUNNING")
        self.assertIn((2, 30), self.first_starts(job, 2))
        self.assert_not_doubled(job)


class Launchers(SlurmTest):
    engine = ()

    def test_ranks_start_by_mpirun_and_by_srun(self):
        for launcher in ["mpirun", "srun --mpi=pmix"]:
            with self.subTest(launcher):
                self.server.kill()
                self.server._options = ("--slurm", "--slurm-poll-seconds", "0.2", "--slurm-memory", "--slurm-launcher", launcher)
                self.server.start()
                job = self.submit(bed(0.005), ranks=2)
                self.wait_for(job, "SUCCEEDED", 60)
                started = next(event.started for event in job.watch() if event.HasField("started"))
                self.assertEqual(started.ranks, 2)
                runner = (self.server.folder(job) / "attempts/1/runner.txtpb").read_text()
                self.assertIn(launcher + " -n 2 ", runner)
                asked = self.cluster.say("scontrol", "show", "job", job.message.batch_job)
                self.assertIn("MinMemoryCPU=", asked)


if __name__ == "__main__":
    unittest.main()
