"""A scheduler that runs is connected to as safely as the user's configuration of Dask says."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import xarray as xr

from stepdiag._core import InvalidArgument
from stepdiag.cli import main
from stepdiag.uncertainty.dask_workers import workers_of

distributed = pytest.importorskip("distributed", reason="Dask distributed is an optional dependency")
import dask  # noqa: E402


@pytest.fixture(scope="module")
def credentials(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Files as docs/study.md has them made, by the keys of Dask's configuration that name them."""
    folder, made = tmp_path_factory.mktemp("credentials"), distributed.Security.temporary()
    certificate, key = folder / "cluster.pem", folder / "cluster-key.pem"
    certificate.write_text(made.tls_ca_file)
    key.write_text(made.tls_client_key)
    files = {"ca-file": certificate}
    for role in ("scheduler", "worker", "client"):
        files |= {f"{role}.cert": certificate, f"{role}.key": key}
    return {f"distributed.comm.tls.{name}": str(file) for name, file in files.items()}


@pytest.fixture(scope="module")
def cluster(credentials: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a scheduler with TLS."""
    scratch = {"temporary-directory": str(tmp_path_factory.mktemp("scratch"))}
    options = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": "127.0.0.1:0"}
    with (
        dask.config.set(credentials | scratch),
        distributed.LocalCluster(protocol="tls://", host="127.0.0.1", **options) as cluster,
    ):
        yield cluster.scheduler_address


@pytest.mark.slow
def test_scheduler_with_tls_finds_its_credentials_in_the_environment(
    cluster: str, credentials: dict[str, str], here: Path
) -> None:
    arguments = ["uncertainty", "scenario.toml", "-n", "30000", "-o"]
    named = {f"DASK_{name.replace('.', '__').replace('-', '_').upper()}": file for name, file in credentials.items()}
    command = [sys.executable, "-c", "from stepdiag.cli import main; raise SystemExit(main())", *arguments]
    done = subprocess.run(
        [*command, "there.nc", "--scheduler", cluster], env=os.environ | named, capture_output=True, text=True
    )
    assert (done.returncode, "warning" in done.stderr) == (0, False), done.stderr
    assert main([*arguments, "here.nc"]) == 0
    with xr.open_dataset("here.nc") as local, xr.open_dataset("there.nc") as there:
        assert there.identical(local)


def test_scheduler_with_tls_refuses_other_credentials(cluster: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepdiag.uncertainty.dask_workers.CONNECT_SECONDS", 2.0)
    made = distributed.Security.temporary()
    others = {"ca-file": made.tls_ca_file, "client.cert": made.tls_client_cert, "client.key": made.tls_client_key}
    with (
        dask.config.set({f"distributed.comm.tls.{name}": content for name, content in others.items()}),
        pytest.raises(InvalidArgument, match=f"^`scheduler`: {cluster}: no scheduler answers"),
        workers_of(cluster),
    ):
        pass


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"ca-file": None}, r"tls_client_cert=Local \(.*cluster.pem\)"),
        ({"client.cert": None}, r"tls_ca_file=Local \(.*cluster.pem\)"),
        ({"client.cert": "nowhere.pem"}, r"tls_client_cert=Local \(.*nowhere.pem\).*: \[Errno 2\]"),
        ({"client.key": "empty.pem"}, r"tls_client_key=Local \(.*empty.pem\).*: \[SSL\]"),
    ],
)
def test_credentials_that_are_missing_are_named(
    changed: dict[str, str], said: str, credentials: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty.pem").touch()
    expected = r"^`scheduler`: tls://127.0.0.1:9: expected ca-file, client.cert and client.key in Dask's configuration"
    with (
        dask.config.set(credentials | {f"distributed.comm.tls.{name}": file for name, file in changed.items()}),
        pytest.raises(InvalidArgument, match=expected) as error,
        workers_of("tls://127.0.0.1:9"),
    ):
        pass
    error.match(said)


def test_encryption_that_the_configuration_requires_is_kept_to() -> None:
    expected = "^`scheduler`: expected tls://, which Dask's configuration requires, got 'tcp://127.0.0.1:9'"
    with (
        dask.config.set({"distributed.comm.require-encryption": True}),
        pytest.raises(InvalidArgument, match=expected),
        workers_of("tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize(
    ("address", "warned"),
    [
        ("tcp://192.0.2.1:9", True),
        ("tcp://[2001:db8::1]:9", True),
        ("tcp://cluster.example:9", True),
        ("tcp://127.0.0.1:9", False),
        ("tcp://[::1]:9", False),
        ("tcp://localhost:9", False),
        ("tls://192.0.2.1:9", False),
    ],
)
def test_scheduler_of_a_network_without_tls_has_a_warning(
    address: str, warned: bool, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def answers_nobody(*arguments: object, **options: object) -> None:
        raise OSError("nobody")

    monkeypatch.setattr(distributed, "Client", answers_nobody)
    assert main(["uncertainty", "scenario.toml", "-n", "30000", "-o", "there.nc", "--scheduler", address]) == 2
    expected = f"warning: {address}: anybody who can reach a scheduler without TLS can run code on its workers"
    assert (expected in capsys.readouterr().err) == warned
