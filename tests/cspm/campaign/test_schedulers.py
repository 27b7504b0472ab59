"""Campaigns on schedulers and workers that others have started, and lose."""

import datetime
import os
import shutil
import signal
import subprocess
from pathlib import Path

import campaigns
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from waiting import PATIENCE_S, until

import cspm

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

ROOT = Path(__file__).parents[3]


def test_a_campaign_runs_on_a_scheduler_that_is_there(tmp_path):
    with campaigns.Cluster(tmp_path) as cluster:
        cluster.worker()
        file = campaigns.written(tmp_path)
        code, out, err = campaigns.run(file, "--scheduler", cluster.address)
        assert (code, err) == (0, ""), out
    rows = campaigns.rows(tmp_path / "campaigns/sweep")
    alone = [cspm.simulate("calm", seed=row["seed"], duration=0.5) for row in rows]
    assert [row["tension.max"] for row in rows] == [run.summary["tension"]["max"] for run in alone]


def test_a_worker_of_another_version_is_refused(tmp_path):
    """A copy of the package with a further comment is other code."""
    copy = tmp_path / "other"
    for package in ROOT.glob("cspm*"):
        if (package / "__init__.py").exists():
            shutil.copytree(package, copy / package.name)
    with (copy / "cspm_sim/plant.py").open("a") as file:
        file.write("# Another version.\n")
    with campaigns.Cluster(tmp_path) as cluster:
        cluster.worker(env=os.environ | {"PYTHONPATH": str(copy)})
        file = campaigns.written(tmp_path)
        code, _, err = campaigns.run(file, "--scheduler", cluster.address)
    assert code == 2
    assert "worker tcp://127.0.0.1:" in err
    assert err.count("cspm 0.") == 2
    assert campaigns.journalled(tmp_path / "campaigns/sweep") == 0


def test_a_worker_with_several_threads_is_refused(tmp_path):
    with campaigns.Cluster(tmp_path) as cluster:
        cluster.worker("--nthreads", 2)
        file = campaigns.written(tmp_path)
        code, _, err = campaigns.run(file, "--scheduler", cluster.address)
    assert code == 2
    assert "2 threads, allowed: 1 (`dask worker --nthreads 1 --nworkers 2`)" in err


def test_nobody_at_the_address_is_one_line(tmp_path):
    file = campaigns.written(tmp_path)
    environment = os.environ | {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "2s"}
    code, _, err = campaigns.run(file, "--scheduler", "tcp://127.0.0.1:9", env=environment)
    assert code == 2
    assert "--scheduler tcp://127.0.0.1:9: " in err
    assert len(err.splitlines()) == 1


def test_a_worker_that_is_killed_costs_its_run_once_more(tmp_path):
    text = campaigns.SWEEP.replace("to: 4", "to: 15")
    file, folder = campaigns.written(tmp_path, text), tmp_path / "campaigns/sweep"
    with campaigns.Cluster(tmp_path) as cluster:
        first = cluster.worker("--no-nanny")
        program = campaigns.begun(file, "--scheduler", cluster.address)
        until(lambda: campaigns.journalled(folder) >= 2, "two runs")
        first.send_signal(signal.SIGKILL)
        cluster.worker()
        out, _ = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 0, out
    rows = campaigns.rows(folder)
    assert [row["seed"] for row in rows] == [*range(1, 16)]
    assert {row["status"] for row in rows} == {"done"}


def test_what_was_done_is_kept_when_the_scheduler_is_killed(tmp_path):
    text = campaigns.SWEEP.replace("to: 4", "to: 400")
    file, folder = campaigns.written(tmp_path, text), tmp_path / "campaigns/sweep"
    with campaigns.Cluster(tmp_path) as cluster:
        cluster.worker()
        program = campaigns.begun(file, "--scheduler", cluster.address)
        until(lambda: campaigns.journalled(folder) >= 2, "two runs")
        cluster.scheduler.send_signal(signal.SIGKILL)
        _, err = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 1
    assert "the scheduler is lost; the runs that ended are kept, and" in err
    assert "Traceback" not in err
    assert len(campaigns.rows(folder)) == campaigns.journalled(folder) >= 2


def certificate(folder):
    """Write a certificate of one's own for 127.0.0.1, and return what dask has to be given."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "a laboratory")])
    now = datetime.datetime.now(datetime.timezone.utc)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    pem, private = folder / "lab.pem", folder / "lab.key"
    pem.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    private.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return pem, private


def of_tls(pem, private):
    """Return the environment by which dask finds certificates."""
    found = {"CA_FILE": pem}
    for role in ("CLIENT", "SCHEDULER", "WORKER"):
        found |= {f"{role}__CERT": pem, f"{role}__KEY": private}
    return {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(path) for name, path in found.items()}


def test_connections_are_encrypted_by_certificates_of_ones_own(tmp_path):
    pem, private = certificate(tmp_path)
    options = ("--tls-ca-file", pem, "--tls-cert", pem, "--tls-key", private)
    file = campaigns.written(tmp_path)
    with campaigns.Cluster(tmp_path, *options, protocol="tls") as cluster:
        cluster.worker("--protocol", "tls")
        assert cluster.address.startswith("tls://")
        known = os.environ | of_tls(pem, private)
        code, out, err = campaigns.run(file, "--scheduler", cluster.address, env=known)
        assert (code, err) == (0, ""), out
        (tmp_path / "stranger").mkdir()
        stranger = os.environ | of_tls(*certificate(tmp_path / "stranger"))
        stranger["DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"] = "3s"
        options = ("--scheduler", cluster.address, "--out", tmp_path / "again")
        code, _, err = campaigns.run(file, *options, env=stranger)
        assert code == 2
        assert f"--scheduler {cluster.address}: " in err
    assert len(campaigns.rows(tmp_path / "campaigns/sweep")) == 4


class Namespaces:
    """Two computers on a wire, as far as programs can tell."""

    def __init__(self):
        # Names of the kernel's, short, and of this process alone.
        self._names = [f"cspm{os.getpid()}{end}" for end in "ab"]

    def __enter__(self):
        self._ip("netns", "add", self._names[0])
        self._ip("netns", "add", self._names[1])
        ends = [f"v{os.getpid()}{end}" for end in "ab"]
        self._ip("link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
        for number, (name, end) in enumerate(zip(self._names, ends, strict=True), start=1):
            self._ip("link", "set", end, "netns", name)
            self._ip("-n", name, "addr", "add", f"10.91.0.{number}/24", "dev", end)
            self._ip("-n", name, "link", "set", end, "up")
            self._ip("-n", name, "link", "set", "lo", "up")
        return self

    def __exit__(self, *_):
        for name in self._names:
            subprocess.run(["ip", "netns", "del", name], check=False)

    def inside(self, number, *words):
        return ["ip", "netns", "exec", self._names[number], *map(str, words)]

    def _ip(self, *words):
        subprocess.run(["ip", *words], check=True, capture_output=True)


def may_make_namespaces():
    if shutil.which("ip") is None:
        return False
    name = f"cspm{os.getpid()}x"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False)
    if made.returncode == 0:
        subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)
    return made.returncode == 0


@pytest.mark.skipif(not may_make_namespaces(), reason="needs the right to make network namespaces")
def test_scheduler_and_worker_on_different_computers(tmp_path):
    file, started = campaigns.written(tmp_path), []
    with Namespaces() as net, (tmp_path / "dask.log").open("w") as log:
        address = "tcp://10.91.0.1:8786"
        options = ("--host", "10.91.0.1", "--port", "8786", "--no-dashboard")
        commands = [
            net.inside(0, campaigns.DASK, "scheduler", *options),
            net.inside(1, campaigns.DASK, "worker", address, "--nthreads", 1, "--no-dashboard"),
        ]
        try:
            for command in commands:
                process = subprocess.Popen(command, stdout=log, stderr=log, cwd=tmp_path)
                started.append(process)
            command = net.inside(0, campaigns.CSPM, "campaign", file, "--scheduler", address)
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                cwd=tmp_path,
                timeout=2 * PATIENCE_S,
            )
        finally:
            for process in reversed(started):
                process.terminate()
                process.wait(30)
    assert (done.returncode, done.stderr) == (0, ""), (tmp_path / "dask.log").read_text()
    assert [row["status"] for row in campaigns.rows(tmp_path / "campaigns/sweep")] == ["done"] * 4
