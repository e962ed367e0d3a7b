"""The executor slurm on a real Slurm of one node: submission, its queue, adoption, and what must not be twice. More: slurm_long_test."""
import os
import shutil
import subprocess
import unittest

import bedflow
from real_server import wait_until
from slurm_fixture import SlurmTest, fake_case


class Submission(SlurmTest):
    def test_a_job_runs_to_its_end_under_a_name_of_its_own(self):
        job = self.submit(fake_case(20))
        self.wait_for(job, "SUCCEEDED")
        numbers = self.slurm_jobs(job)
        self.assertEqual(job.message.batch_job, numbers[0])
        self.assertEqual(job.message.node, self.cluster.host)
        server_id = (self.server.path / "data/server_id").read_text()
        self.assertIn((numbers[0], f"bedflow-{server_id}-{job.id}-1"), [one[:2] for one in self.cluster.jobs()])
        shown = self.server.client("get", job.id).stdout
        self.assertIn(f"{numbers[0]} on {self.cluster.host}", shown)

    def test_one_that_waits_in_slurms_queue_says_so_and_is_withdrawn(self):
        first = self.submit(fake_case(100_000), ranks=4)
        self.wait_for(first, "RUNNING")
        second, third = self.submit(fake_case(10)), self.submit(fake_case(10))
        for job in [second, third]:
            self.assertTrue(wait_until(lambda: "in Slurm's queue (job" in job.refresh().message.waits_for), job.message)
            self.assertEqual(job.state, "STARTING")
        info = self.bedflow.info().executor_infos[1]
        self.assertEqual((info.name, info.jobs_running, info.jobs_queued), ("slurm", 1, 2))
        self.assertIn("1 running, 2 in its queue", self.server.client("server", "info").stdout)
        second.suspend()
        third.cancel()
        self.wait_for(second, "SUSPENDED")
        self.wait_for(third, "CANCELLED")
        self.assertEqual(self.starts(second) + self.starts(third), [])
        first.cancel()
        self.wait_for(first, "CANCELLED")
        second.resume()
        self.wait_for(second, "SUCCEEDED")
        self.assertEqual(self.starts(second), [(2, 0)])

    def test_a_submission_whose_answer_is_lost_is_found_and_not_repeated(self):
        # sbatch does its work, and then says that the controller has not answered.
        folder = self.server.path / "bin"
        folder.mkdir()
        (folder / "sbatch").write_text(f"#!/bin/sh\n{shutil.which('sbatch')} \"$@\" >/dev/null || exit\n"
                                       "echo 'sbatch: error: Batch job submission failed: Socket timed out on send/recv operation' >&2\nexit 1\n")
        (folder / "sbatch").chmod(0o755)
        path = os.environ["PATH"]
        os.environ["PATH"] = f"{folder}:{path}"
        try:
            self.server.kill()
            self.server.start()
        finally:
            os.environ["PATH"] = path
        job = self.submit(fake_case(30))
        self.wait_for(job, "SUCCEEDED")
        self.assertEqual(len(self.slurm_jobs(job)), 1)
        self.assertEqual(job.message.epoch, 1)
        self.assertIn("is submitted again", self.server_log())

    def test_faults_are_told_before_anything_is_submitted(self):
        with self.assertRaises(bedflow.Error) as caught:
            self.submit(fake_case(10), ranks=5000)
        self.assertIn("1 to 1024 ranks (of one job)", str(caught.exception.faults))


class Adoption(SlurmTest):
    def test_a_killed_servers_jobs_run_on_and_the_next_server_follows_them(self):
        running, queued = self.submit(fake_case(200), ranks=4), None
        self.wait_for_step(running, 5)
        queued = self.submit(fake_case(10))
        self.assertTrue(wait_until(lambda: len(self.slurm_jobs(queued)) == 1))
        self.server.kill()
        self.server.start()
        self.wait_for(running, "SUCCEEDED")
        self.wait_for(queued, "SUCCEEDED")
        for job in [running, queued]:
            self.assertEqual(len(self.slurm_jobs(job)), 1)
            self.assertEqual(job.message.epoch, 1)

    def test_a_job_that_ends_while_no_server_is_there_is_found_ended(self):
        job = self.submit(fake_case(60))
        self.wait_for_step(job, 1)
        self.server.kill()
        self.assertTrue(wait_until(lambda: (self.server.folder(job) / "attempts/1/exit.txtpb").exists()))
        self.server.start()
        self.wait_for(job, "SUCCEEDED")
        self.assertEqual(job.message.epoch, 1)

    def test_a_second_start_of_an_attempt_does_nothing(self):
        job = self.submit(fake_case(200))
        self.wait_for_step(job, 5)
        attempt = self.server.folder(job) / "attempts/1"
        (attempt / "lock").unlink()  # as on a file system without locks
        again = subprocess.run(["sh", attempt / "batch.sh"], capture_output=True, text=True, timeout=20,
                               env=os.environ | {"SLURM_JOB_ID": job.message.batch_job})
        self.assertEqual(again.returncode, 75, again.stderr)
        self.assertIn("has been run already", again.stderr)
        self.wait_for(job, "SUCCEEDED")
        self.assertEqual(job.message.epoch, 1)
        self.assert_not_doubled(job)


if __name__ == "__main__":
    unittest.main()
