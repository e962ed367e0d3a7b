"""A Slurm of one node, started from Debian's packages in a folder of its own: munged, slurmctld, slurmd. No systemd, no control
groups; keys, sockets and ports of its own, the latter on loopback. For tests of the executor."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time

from real_server import wait_until

PROGRAMS = ["munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol"]

CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={path}/munge/socket
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={controller_port}
SlurmdPort={node_port}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
StateSaveLocation={path}/state
SlurmdSpoolDir={path}/spool
SlurmctldPidFile={path}/slurmctld.pid
SlurmdPidFile={path}/slurmd.pid
SlurmctldLogFile={path}/slurmctld.log
SlurmdLogFile={path}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=0,sched_interval=2
SlurmdParameters=config_overrides
MpiDefault=none
ReturnToService=2
KillWait=2
MinJobAge=300
InactiveLimit=0
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=8000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=60 DefMemPerCPU=100 State=UP
"""


def missing_programs():
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    return [program for program in PROGRAMS if not shutil.which(program, path=path)]


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class SlurmCluster:
    """Started at once; call close() also when a test has failed."""

    def __init__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="bedflow-slurm-"))
        self.path.chmod(0o755)  # munged refuses a socket that others cannot come to
        self.host = socket.gethostname().split(".")[0]
        self.configuration = self.path / "slurm.conf"
        self.daemons = {}
        try:
            self._configure()
            self.start("munged")
            self.start("slurmctld")
            self.start("slurmd")
            if not wait_until(lambda: self.node_state() == "idle", 60):
                raise RuntimeError("Slurm does not come up: " + self.logs())
        except BaseException:
            self.close()
            raise

    def _configure(self):
        for folder in ["munge", "state", "spool"]:
            (self.path / folder).mkdir(mode=0o755)
        key = self.path / "munge" / "key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o600)
        controller_port, node_port = free_ports(2)
        user = subprocess.run(["id", "-un"], capture_output=True, text=True, check=True).stdout.strip()
        self.configuration.write_text(CONFIGURATION.format(path=self.path, host=self.host, user=user, controller_port=controller_port,
                                                           node_port=node_port))

    def environment(self):
        return os.environ | {"SLURM_CONF": str(self.configuration), "PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}

    def start(self, daemon):
        munge = self.path / "munge"
        command = {
            "munged": ["munged", "--foreground", "--key-file", munge / "key", "--socket", munge / "socket", "--pid-file", munge / "pid",
                       "--seed-file", munge / "seed", "--log-file", munge / "log"],
            "slurmctld": ["slurmctld", "-D"],
            "slurmd": ["slurmd", "-D"],
        }[daemon]
        with open(self.path / f"{daemon}.out", "ab") as log:
            self.daemons[daemon] = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                                    env=self.environment())
        if daemon == "munged" and not wait_until((munge / "socket").exists, 20):
            raise RuntimeError("munged does not come up: " + self.logs())
        if daemon == "slurmctld" and not wait_until(lambda: self.ask("scontrol", "ping").returncode == 0, 60):
            raise RuntimeError("slurmctld does not come up: " + self.logs())

    def stop(self, daemon, how=signal.SIGKILL):
        process = self.daemons.pop(daemon)
        process.send_signal(how)
        process.wait(20)

    def ask(self, *command):
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL,
                              env=self.environment())

    def say(self, *command):
        answer = self.ask(*command)
        if answer.returncode != 0:
            raise RuntimeError(f"{command}: {answer.stderr}")
        return answer.stdout

    def node_state(self):
        return self.ask("sinfo", "--noheader", "--format=%t").stdout.strip()

    def jobs(self):
        """(number, name, state) of each that Slurm remembers."""
        return [tuple(line.split("|")) for line in self.say("squeue", "--noheader", "--states=all", "--format=%i|%j|%T").splitlines()]

    def processes(self):
        """What its jobs have started on the node, and Slurm's own that watch over them."""
        found = []
        for folder in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                environment = (folder / "environ").read_bytes()
                is_of_job = b"SLURM_JOB_ID=" in environment or (folder / "cmdline").read_bytes().startswith(b"slurmstepd")
                if f"SLURM_CONF={self.configuration}".encode() in environment and is_of_job:
                    found.append(int(folder.name))
            except OSError:
                pass  # it is gone
        return found

    def lose_node(self):
        """The node and all on it are gone, and the controller is told."""
        self.stop("slurmd")

        def all_gone():
            return not [process for process in self.processes() if self._kill(process)]

        if not wait_until(all_gone):
            raise RuntimeError("the node's processes do not end")
        self.say("scontrol", "update", f"nodename={self.host}", "state=down", "reason=lost")

    @staticmethod
    def _kill(process):
        """True while it is there."""
        try:
            os.kill(process, signal.SIGKILL)
            return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        except OSError:
            return False

    def return_node(self):
        self.start("slurmd")
        self.free_node()

    def free_node(self):
        """Takes away what Slurm has against the node: it drains one on which something went wrong."""
        def is_free():
            if self.node_state() in ("idle", "mix", "alloc"):
                return True
            self.ask("scontrol", "update", f"nodename={self.host}", "state=resume")
            return False
        if not wait_until(is_free, 60):
            raise RuntimeError("the node does not come back: " + self.logs())

    def logs(self):
        text = ""
        for name in ["munge/log", "munged.out", "slurmctld.log", "slurmctld.out", "slurmd.log", "slurmd.out"]:
            if (self.path / name).exists():
                text += f"\n--- {name}\n" + (self.path / name).read_text(errors="replace")[-3000:]
        return text

    def cancel_all(self):
        """Until none waits or runs."""
        def active():
            return [number for number, _, state in self.jobs() if state in ("PENDING", "RUNNING", "COMPLETING")]
        if numbers := active():
            self.ask("scancel", *numbers)  # killing what watches over them would have Slurm drain the node
        if not wait_until(lambda: not active()):
            raise RuntimeError("Slurm's jobs do not end: " + self.logs())

    def close(self):
        for process in self.processes():
            self._kill(process)
        for daemon in ["slurmd", "slurmctld", "munged"]:
            if daemon in self.daemons:
                self.stop(daemon)
        deadline = time.monotonic() + 10
        while self.processes() and time.monotonic() < deadline:
            for process in self.processes():
                self._kill(process)
            time.sleep(0.05)
        shutil.rmtree(self.path, ignore_errors=True)
