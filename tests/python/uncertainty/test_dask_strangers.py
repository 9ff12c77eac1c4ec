"""Workers of this computer belong to who started them: strangers reach their ports, but get nothing done, learn nothing
and slip nothing in."""

import asyncio
import importlib.util
import os
import pickle
import socket
import ssl
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from stepdiag._core import InvalidArgument
from stepdiag.uncertainty.dask_workers import Workers, workers_of

distributed = pytest.importorskip("distributed", reason="Dask distributed is an optional dependency")
import dask  # noqa: E402
import psutil  # noqa: E402 (comes with distributed)

Connection = dict[str, Any]

SECONDS = 2.0  # that a stranger keeps trying
PLANTED = "planted_by_a_stranger"
KIND = "-----BEGIN PRIVATE KEY-----"


@pytest.fixture(scope="module")
def temporary(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder for temporary files, in which a stranger has made the one that Dask takes modules from by default."""
    folder = tmp_path_factory.mktemp("temporary")
    planted = folder / "dask-scratch-space"
    planted.mkdir()
    planted.chmod(0o777)
    (planted / f"{PLANTED}.py").touch()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(folder))  # for the workers
        patch.setattr(tempfile, "tempdir", str(folder))
        yield folder


@pytest.fixture(scope="module")
def others_ports() -> set[tuple[str, int]]:
    """What tests of other files have left open in this process."""
    return listening()


@pytest.fixture(scope="module")
def key_folders() -> list[int]:
    """Permissions of the folders from which keys were loaded."""
    return []


@pytest.fixture(scope="module")
def two(temporary: Path, others_ports: set[tuple[str, int]], key_folders: list[int]) -> Iterator[Workers]:
    load = ssl.SSLContext.load_cert_chain

    def look_and_load(context: ssl.SSLContext, certificate: str, key: str) -> None:
        key_folders.append(Path(key).parent.stat().st_mode & 0o777)
        load(context, certificate, key)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ssl.SSLContext, "load_cert_chain", look_and_load)
        with workers_of(count=2) as workers:
            yield workers


def processes() -> list[psutil.Process]:
    this = psutil.Process()
    return [this, *this.children(recursive=True)]


def listening() -> set[tuple[str, int]]:
    """Address and port of every socket of these processes that strangers can send to."""
    states = psutil.CONN_LISTEN, psutil.CONN_NONE  # the latter is UDP's
    found = [each for process in processes() for each in process.net_connections("inet")]
    return {tuple(each.laddr) for each in found if each.status in states}


def addresses(workers: Workers) -> dict[str, str]:
    """Of all that can be connected to; the handler that runs a function has another name in a scheduler."""
    known = workers._client.scheduler_info()["workers"]
    both = [address for worker, said in known.items() for address in (worker, said["nanny"])]
    return {workers.address: "run_function"} | dict.fromkeys(both, "run")


async def make_folders(places: dict[str, str], parent: Path, connection: Connection) -> list[Any]:
    """Lets a function run at all these addresses, which makes a folder named after the port."""

    async def make(address: str, handler: str) -> None:
        folder = parent / address.rpartition(":")[2]
        async with distributed.rpc(address, timeout=SECONDS, connection_args=connection) as there:
            await getattr(there, handler)(function=pickle.dumps(os.mkdir), args=pickle.dumps((str(folder),)))

    return await asyncio.gather(*(make(*place) for place in places.items()), return_exceptions=True)


def own(workers: Workers) -> Connection:
    return workers._client.security.get_connection_args("client")


def test_owner_can_run_functions_everywhere(two: Workers, tmp_path: Path) -> None:
    """Without which the tests below would say nothing."""
    asyncio.run(make_folders(addresses(two), tmp_path, own(two)))
    assert len(list(tmp_path.iterdir())) == 5  # a scheduler, two workers, two nannies


def without_certificate() -> Connection:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return {"ssl_context": context}


def with_other_credentials() -> Connection:
    return distributed.Security.temporary().get_connection_args("client")


@pytest.mark.parametrize(
    ("scheme", "connection"), [("tcp", dict), ("tls", without_certificate), ("tls", with_other_credentials)]
)
def test_strangers_run_nothing_anywhere(two: Workers, tmp_path: Path, scheme: str, connection: Any) -> None:
    places = {address.replace("tls", scheme): handler for address, handler in addresses(two).items()}
    errors = asyncio.run(make_folders(places, tmp_path, connection()))
    assert [error for error in errors if not isinstance(error, OSError)] == []
    assert list(tmp_path.iterdir()) == []
    assert [answer for _, answer in two.compute(abs, [(-1,), (-2,)])] in ([1, 2], [2, 1]), "still at work"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["tcp", "tls"])
def test_strangers_are_neither_clients_nor_workers(two: Workers, tmp_path: Path, scheme: str) -> None:
    address = two.address.replace("tls", scheme)
    security = distributed.Security.temporary() if scheme == "tls" else None
    known = set(addresses(two))
    with pytest.raises(OSError, match=r".*"):
        distributed.Client(address, security=security, timeout=SECONDS, set_as_default=False)

    async def join() -> None:
        async with distributed.Worker(address, security=security, death_timeout=SECONDS):
            pass

    with dask.config.set({"temporary-directory": str(tmp_path)}), pytest.raises(TimeoutError):
        asyncio.run(join())
    assert set(addresses(two)) == known


def test_bytes_of_a_stranger_are_answered_with_nothing(two: Workers) -> None:
    for address in addresses(two):
        host, port = address.removeprefix("tls://").split(":")
        with socket.create_connection((host, int(port)), timeout=30.0) as stranger:
            stranger.sendall(b"GET /info/main/workers.html HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            answer = b""
            with suppress(ConnectionResetError):
                while more := stranger.recv(1024):
                    answer += more
        assert len(answer) <= 7, "more than a TLS alert"


def test_nothing_listens_but_scheduler_workers_and_nannies_on_loopback(
    two: Workers, others_ports: set[tuple[str, int]]
) -> None:
    places = [address.removeprefix("tls://").split(":") for address in addresses(two)]
    assert listening() - others_ports == {("127.0.0.1", int(port)) for _, port in places}


def pages(dask_worker: Any = None, dask_scheduler: Any = None) -> int:
    return len((dask_worker or dask_scheduler).http_application.wildcard_router.rules)


def test_http_servers_have_nothing_to_serve_before_they_are_stopped(two: Workers) -> None:
    """Who is quick enough may connect in between, and the connection stays."""
    assert two._client.run_on_scheduler(pages) == 0
    assert set(two._client.run(pages).values()) == {0}


def test_private_key_is_in_no_file_argument_or_environment(
    two: Workers, temporary: Path, key_folders: list[int]
) -> None:
    """OpenSSL loads it from a file only, which is in a folder for the owner's eyes until then."""
    key = two._client.security.tls_worker_key
    line = key.splitlines()[1]
    assert key.startswith(KIND)
    assert set(key_folders) == {0o700}
    assert [path for path in temporary.rglob("*") if path.is_file() and line in path.read_text()] == []
    for process in processes():
        assert line not in " ".join(process.cmdline())
        assert line not in str(process.environ())


def test_modules_that_a_stranger_planted_are_not_found(two: Workers, temporary: Path) -> None:
    assert importlib.util.find_spec(PLANTED) is None
    assert set(two._client.run(importlib.util.find_spec, PLANTED).values()) == {None}
    own = [Path(entry) for entry in sys.path if entry.startswith(str(temporary))]
    assert {(temporary / folder.relative_to(temporary).parts[0]).stat().st_mode & 0o777 for folder in own} == {0o700}


def test_nothing_is_left_of_workers_that_are_done(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's path neither: whoever makes a folder of that name again would be believed."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    before, path = set(temporary.iterdir()), list(sys.path)
    with workers_of(count=1):
        assert len(set(temporary.iterdir()) - before) == 1
        assert len(sys.path) > len(path)
        sys.path.insert(0, "first")  # where Dask looks for the entries that it removes
    assert set(temporary.iterdir()) == before
    assert sys.path == ["first", *path]


def test_missing_cryptography_is_said_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cryptography", None)
    expected = r"^`workers` needs cryptography \(pip install 'stepdiag\[dask\]'\)"
    with pytest.raises(InvalidArgument, match=expected), workers_of(count=1):
        pass
