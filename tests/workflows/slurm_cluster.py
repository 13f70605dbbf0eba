"""A SLURM cluster on this machine: one controller and two nodes of one CPU, with ports and folders
of their own, and without the keys of a real cluster.

submitit asks `sacct` whether a job was killed. The real `sacct` needs a database for accounting, so
a script of the same name asks the controller instead.
"""

from __future__ import annotations

import getpass
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

PROGRAMS = ("slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "srun")
NODES = ("node1", "node2")
SYSTEM = ("/usr/sbin", "/usr/local/sbin")
READY_S = 60.0
SACCT = """\
#!/bin/sh
echo 'JobID|State|NodeList'
scontrol --oneliner show jobs | sed -nE \\
    's/.*ArrayJobId=([0-9]+) ArrayTaskId=([^ ]+) .*JobState=([A-Z_]+) .*/\\1_\\2|\\3|none/p' |
    sed -E 's/_([0-9]+[-,%][^|]*)/_[\\1]/'
"""
CONFIG = """\
ClusterName=isethdr
SlurmctldHost={host}
SlurmctldPort={controller}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
KillWait=2
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool_%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd_%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd_%n.log
{nodes}
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing() -> list[str]:
    """Return the programs of SLURM that are not installed."""
    path = os.pathsep.join([os.environ["PATH"], *SYSTEM])
    return [name for name in PROGRAMS if shutil.which(name, path=path) is None]


@contextmanager
def cluster(folder: Path) -> Iterator[dict[str, str]]:
    """Run a cluster, and yield the variables under which its commands find it."""
    host = socket.gethostname().partition(".")[0]
    controller, *ports = free_ports(1 + len(NODES))
    nodes = "\n".join(
        f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 State=UNKNOWN"
        for name, port in zip(NODES, ports, strict=True)
    )
    for part in ("state", *(f"spool_{name}" for name in NODES)):
        (folder / part).mkdir(parents=True)
    sacct = folder / "bin" / "sacct"
    sacct.parent.mkdir()
    sacct.write_text(SACCT)
    sacct.chmod(0o755)
    config = folder / "slurm.conf"
    user = getpass.getuser()
    values = {"host": host, "controller": controller, "user": user, "folder": folder}
    config.write_text(CONFIG.format(**values, nodes=nodes))
    variables = {
        "SLURM_CONF": str(config),
        "PATH": os.pathsep.join([str(sacct.parent), os.environ["PATH"], *SYSTEM]),
    }
    with ExitStack() as stack:
        stack.enter_context(daemon(["slurmctld", "-D", "-f", str(config)], variables))
        for name in NODES:
            stack.enter_context(daemon(["slurmd", "-D", "-N", name, "-f", str(config)], variables))
        wait_until_idle(variables, folder)
        try:
            yield variables
        finally:
            stop_jobs(variables)


@contextmanager
def daemon(command: list[str], variables: dict[str, str]) -> Iterator[None]:
    """Run one daemon in the foreground of a process of its own."""
    process = subprocess.Popen(
        command,
        env={**os.environ, **variables},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_until_idle(variables: dict[str, str], folder: Path) -> None:
    """Wait until all nodes have registered with the controller."""
    expected = [word for name in NODES for word in (name, "idle")]
    asked = ("sinfo", "--noheader", "--Node", "--format=%N %t")
    if not wait_until(lambda: answer(variables, *asked).split() == expected):
        logs = "\n".join(path.read_text()[-2000:] for path in folder.glob("*.log"))
        raise RuntimeError(f"SLURM is not ready: {answer(variables, *asked)}\n{logs}")


def wait_until(holds: Callable[[], bool]) -> bool:
    """Wait up to `READY_S` until a condition holds, and return whether it does."""
    end = time.monotonic() + READY_S
    while not (held := holds()) and time.monotonic() < end:
        time.sleep(0.2)
    return held


def stop_jobs(variables: dict[str, str]) -> bool:
    """End all jobs of the cluster, and return whether they are gone."""
    answer(variables, "scancel", f"--user={getpass.getuser()}")
    return wait_until(lambda: not answer(variables, "squeue", "--noheader"))


def workers(variables: dict[str, str]) -> list[int]:
    """Return the processes of this cluster that compute a job."""
    own = f"SLURM_CONF={variables['SLURM_CONF']}".encode()
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (process / "cmdline").read_bytes().split(b"\0")
            program = words[0].rpartition(b"/")[2]
            if b"submitit.core._submit" not in words or not program.startswith(b"python"):
                continue
            if own in (process / "environ").read_bytes().split(b"\0"):
                found.append(int(process.name))
    return sorted(found)


def answer(variables: dict[str, str], *command: str) -> str:
    """Return what a command of SLURM prints."""
    return subprocess.run(
        command, env={**os.environ, **variables}, capture_output=True, text=True, check=False
    ).stdout


def free_ports(count: int) -> list[int]:
    """Return ports that no process listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
