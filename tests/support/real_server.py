"""A real bedflowd with the real engine in a folder of its own, and small beds, for tests in Python."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

import bedflow

BIN = pathlib.Path(os.environ["BEDFLOW_BIN"])

BED = """
name: "small-bed"
domain {{
  size {{ x: 0.024 y: 0.048 z: 0.01 }}
  cells {{ x: 8 y: 16 z: 4 }}
  faces {{ y_low {{ inflow {{ velocity: 0.5 }} }} y_high {{ outflow {{}} }} }}
}}
gravity {{ y: -9.81 }}
gas {{ density: 1.2 viscosity: 1.8e-5 simple {{}} upwind {{}} }}
particles {{
  diameter: 1.2e-3
  density: 1000
  linear_spring_dashpot {{ stiffness: 440 restitution: 0.9 }}
  spring {{ friction: 0.1 }}
  random {{ count: 500 seed: 1 region {{ low {{}} high {{ x: 0.024 y: 0.02 z: 0.01 }} }} }}
  symplectic_euler {{}}
}}
coupling {{ gidaspow_blended {{}} hat {{}} explicit {{}} }}
time {{ end: {end} }}
monitors {{ name: "kinetic_energy" kinetic_energy {{}} interval: {interval} }}
monitors {{ name: "bed_height" bed_height {{}} interval: {interval} }}
"""

# 64 000 particles at rest, no gas: checkpoints of several MiB in no time.
CROWD = """
name: "crowd"
domain { size { x: 0.06 y: 0.06 z: 0.06 } }
gravity {}
particles {
  diameter: 0.001
  density: 2500
  linear_spring_dashpot { stiffness: 1000 restitution: 0.8 }
  spring { friction: 0.3 }
  symplectic_euler {}
  lattice { count { x: 40 y: 40 z: 40 } }
}
time { end: 0.0001 }
"""


def bed(end=0.01, interval=0.0005):
    return BED.format(end=end, interval=interval)


class RealServer:
    """Started at once; use it in a with statement."""

    def __init__(self, *options):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="bedflow-"))
        self._options = options
        self.address = f"unix:{self.path}/data/bedflowd.sock"
        self.process = None
        self.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self.end_engines()
        shutil.rmtree(self.path)

    def end_engines(self):
        """Ends what outlives a server: the attempts at jobs in its folder, told by their command lines."""
        def attempts():
            found = []
            for file in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
                try:
                    if f"{self.path}/data/jobs/".encode() in file.read_bytes():
                        found.append(int(file.parent.name))
                except OSError:
                    pass  # it is gone
            return found

        def ended():
            left = attempts()
            for process in left:
                try:
                    os.kill(process, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            return not left

        if not wait_until(ended):
            raise RuntimeError(f"engines of {self.path} do not end")

    def start(self):
        with open(self.path / "server.log", "ab") as log:
            self.process = subprocess.Popen([BIN / "bedflowd", "--data", self.path / "data", *self._options], stdout=subprocess.PIPE,
                                            stderr=log, text=True)
        self.said = self.process.stdout.readline()
        if "listening" not in self.said:
            raise RuntimeError((self.path / "server.log").read_text())

    def kill(self):
        self.process.kill()
        self._end()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        self._end()

    def _end(self):
        self.process.wait(20)
        self.process.stdout.close()

    def connect(self):
        return bedflow.connect(self.address)

    def folder(self, job):
        return self.path / "data/jobs" / job.id

    def checkpoint(self, job, step):
        return self.folder(job) / f"checkpoints/checkpoint_{step:010d}.h5"

    def client(self, *words, **options):
        """What `bedflow words…` does."""
        return subprocess.run([BIN / "bedflow", *map(str, words), "--server", self.address], capture_output=True, text=True, timeout=60,
                              stdin=subprocess.DEVNULL, **options)

    def submitted(self, *options, **case):
        """The id of a job of bed(**case), submitted as users do."""
        file = self.path / "case.txtpb"
        file.write_text(bed(**case))
        answer = self.client("submit", file, *options)
        assert answer.returncode == 0, answer.stderr
        return answer.stdout.strip()


def wait_until(condition, seconds=30):
    """True as soon as it holds; false when it does not within the time."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.01)
    return False
