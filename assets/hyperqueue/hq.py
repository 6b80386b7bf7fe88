#!/usr/bin/env python3
"""Replacement of HyperQueue's `hq` binary with the commands that a sweep needs.

The Python package (`pip install hyperqueue==0.27.0`) holds server, worker and client, but no `hq`.
This script offers them with the same commands and arguments:

    hq.py server start                    run a server until it is stopped (Ctrl-C or `server stop`)
    hq.py server stop
    hq.py worker start [--cpus N]         run a worker of that server until one of the two ends
    hq.py job submit-file JOB.toml        submit the file that `grainscope sweep --engine hq` writes
    hq.py job wait JOB

All commands take `--server-dir DIR` (default: HQ_SERVER_DIR, else ~/.hq-server), the same for
server, workers and clients. grainscope uses this script if HQ_ENTRY="python3 .../hq.py". Workers
count cores only and ignore the memory that tasks request, so give a worker no more cores than the
number of cases that fit into its memory.

Needs Python 3.11 or later.
"""

import argparse
import contextlib
import os
import signal
import sys
import tempfile
import time
import tomllib
from pathlib import Path

try:
    from hyperqueue.ffi.client import ClientConnection
    from hyperqueue.ffi.cluster import Cluster
    from hyperqueue.ffi.protocol import JobDescription, ResourceRequest, TaskDescription
    from hyperqueue.output import StdioDef
except ImportError as e:
    sys.exit(f"the Python package of HyperQueue is missing ({e}); pip install hyperqueue==0.27.0")

# Interval at which a worker checks whether its server still exists, seconds.
ASK = 1.0


def end_on_signals():
    """Makes signals end the process at once, since the threads of server and worker do not stop."""
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: os._exit(0))


def serve(directory):
    """Runs a server until it is stopped."""
    directory.mkdir(parents=True, exist_ok=True)
    cluster = Cluster(str(directory))
    print(f"HyperQueue server in {directory}", flush=True)
    end_on_signals()
    while alive(cluster.server_dir):
        time.sleep(ASK)


@contextlib.contextmanager
def silence():
    """Discards everything that is written to the standard output, also by native code."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def alive(directory, tries=5):
    """Whether a server can be reached in this directory. A busy machine may need several tries."""
    for _ in range(tries):
        try:
            ClientConnection(str(directory))
            return True
        except Exception:
            time.sleep(ASK)
    return False


def work(directory, cpus):
    """Runs a worker in a separate process.

    The package starts a worker only together with a server in the same process; the worker finds
    that server by the link `hq-current` in its folder. So an unused server is started, and the link
    is changed to the intended server.
    """
    meant = directory / "hq-current"
    if not meant.exists():
        sys.exit(f"there is no server in {directory}; start one: hq.py server start")
    own = Path(tempfile.mkdtemp(prefix="hq-worker-"))
    with silence():
        cluster = Cluster(str(own))
    link = own / "hq-current"
    link.unlink()
    link.symlink_to(meant.resolve(), target_is_directory=True)
    cluster.add_worker(cpus)
    print(f"HyperQueue worker with {cpus} cores for {directory}", flush=True)
    end_on_signals()
    while alive(directory):
        time.sleep(ASK)
    os._exit(0)


def stdio(path):
    return StdioDef.from_path(path) if path else None


def task(number, said):
    request = said.get("request", [{}])[0].get("resources", {})
    return TaskDescription(
        id=int(said.get("id", number)),
        args=said["command"],
        cwd=said.get("cwd"),
        stdout=stdio(said.get("stdout")),
        stderr=stdio(said.get("stderr")),
        stdin=None,
        env=said.get("env", {}),
        dependencies=(),
        task_dir=False,
        priority=0,
        resource_request=(ResourceRequest(cpus=str(request.get("cpus", "1"))),),
        crash_limit=said.get("crash_limit"),
    )


def submit(directory, path):
    said = tomllib.loads(Path(path).read_text())
    tasks = [task(number, each) for number, each in enumerate(said["task"], 1)]
    # With max_fails = None a failed task does not cancel others.
    job = JobDescription(name=said.get("name"), tasks=tasks, max_fails=said.get("max_fails"))
    print(ClientConnection(str(directory)).submit_job(job))


def wait(directory, job):
    failed = ClientConnection(str(directory)).wait_for_jobs((job,), lambda _: None)
    sys.exit(1 if failed else 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = os.environ.get("HQ_SERVER_DIR") or Path.home() / ".hq-server"
    parser.add_argument("--server-dir", type=Path, default=Path(default))
    parser.add_argument("--output-mode", choices=["cli", "quiet"], default="cli")
    kinds = parser.add_subparsers(dest="kind", required=True)
    server = kinds.add_parser("server").add_subparsers(dest="what", required=True)
    server.add_parser("start")
    server.add_parser("stop")
    worker = kinds.add_parser("worker").add_subparsers(dest="what", required=True)
    start = worker.add_parser("start")
    start.add_argument("--cpus", type=int, default=os.cpu_count() or 1)
    jobs = kinds.add_parser("job").add_subparsers(dest="what", required=True)
    jobs.add_parser("submit-file").add_argument("path")
    jobs.add_parser("wait").add_argument("job", type=int)
    said = parser.parse_args()
    directory = said.server_dir.absolute()
    try:
        match (said.kind, said.what):
            case ("server", "start"):
                serve(directory)
            case ("server", "stop"):
                ClientConnection(str(directory)).stop_server()
            case ("worker", _):
                work(directory, said.cpus)
            case ("job", "submit-file"):
                submit(directory, said.path)
            case ("job", "wait"):
                wait(directory, said.job)
    except Exception as e:
        sys.exit(f"{e}; is there a server in {directory}? hq.py server start")


if __name__ == "__main__":
    main()
