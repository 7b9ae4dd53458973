"""A real Slurm of one node, with ports, keys and state of its own, without system services."""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol")

CONFIGURATION = """
ClusterName=ringsim
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=6
SlurmctldPort={port}
SlurmdPort={other}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
SlurmdParameters=config_overrides
SwitchType=switch/none
ReturnToService=2
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=2,sched_min_interval=0,bf_interval=2
KillWait=5
MinJobAge=3600
InactiveLimit=0
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN
PartitionName=test Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


@dataclass
class Cluster:
    """A running Slurm; commands need its environment."""

    folder: Path

    def environment(self):
        return os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf")}

    def ask(self, *command, **options):
        done = subprocess.run(
            command, env=self.environment() | options.pop("extra", {}), text=True, timeout=30,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False, **options,
        )  # fmt: skip
        return done.stdout.strip()

    def states(self, job):
        """States of a job and of its array tasks."""
        return self.ask("squeue", "--noheader", "--states=all", "--format=%T", "--job", job).split()


def missing():
    """Why no Slurm can be started here; empty if one can."""
    absent = [name for name in NEEDED if shutil.which(name) is None]
    if absent:
        return f"{', '.join(absent)} not installed: apt-get install slurm-wlm munge"
    return "" if os.geteuid() == 0 else "needs root to start the services"


def free_ports():
    with socket.socket() as one, socket.socket() as two:
        one.bind(("127.0.0.1", 0))
        two.bind(("127.0.0.1", 0))
        return one.getsockname()[1], two.getsockname()[1]


def start(folder):
    """Start a cluster; the text says what went wrong if it is not empty."""
    folder.chmod(0o755)
    for name in ("state", "spool"):
        (folder / name).mkdir(mode=0o755)
    key = folder / "munge.key"
    key.write_bytes(secrets.token_bytes(1024))
    key.chmod(0o600)
    host = socket.gethostname().split(".")[0]
    port, other = free_ports()
    content = CONFIGURATION.format(host=host, folder=folder, port=port, other=other)
    (folder / "slurm.conf").write_text(content)
    cluster = Cluster(folder)
    munge = [
        "munged", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket",
        f"--pid-file={folder}/munged.pid", f"--log-file={folder}/munged.log",
        f"--seed-file={folder}/munged.seed",
    ]  # fmt: skip
    services = [munge, ["slurmctld"], ["slurmd", "-N", host]]
    printed = [cluster.ask(*service) for service in services]
    end = time.monotonic() + 30
    while time.monotonic() < end:
        if cluster.ask("sinfo", "--noheader", "--Node", "--format=%t") == "idle":
            return cluster, ""
        time.sleep(0.2)
    return cluster, f"Slurm does not come up: {' '.join(printed)}"


def stop(cluster):
    """End the services at once, by their process ids."""
    cluster.ask("scancel", "--user=root")
    time.sleep(0.5)
    for name in ("slurmd", "slurmctld", "munged"):
        try:
            number = int((cluster.folder / f"{name}.pid").read_text())
            if name not in Path(f"/proc/{number}/comm").read_text():
                continue
            # At a word they would write their state for seconds, which nobody will read.
            os.kill(number, signal.SIGKILL)
        except (OSError, ValueError):
            continue
