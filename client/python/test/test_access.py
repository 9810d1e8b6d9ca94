"""Bearer tokens and TLS against a real server, and the headers of every call."""

from __future__ import annotations

import asyncio
import base64
import json
import subprocess
from collections.abc import Callable, Iterator
from concurrent import futures
from pathlib import Path

import grpc
import pytest
from conftest import Grid, Server

import lpdeform
from lpdeform.access import Caller
from lpdeform.v1 import service_pb2

_forever = 4102444800  # the year 2100


def _openssl(*arguments: str, stdin: bytes = b"") -> bytes:
    done = subprocess.run(["openssl", *arguments], input=stdin, capture_output=True, timeout=60, check=True)
    return done.stdout


def _base64url(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


class Keys:
    """An authority, certificates from it for a server and a client, an unrelated one, and keys that sign tokens."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        ec = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
        for name in ("authority", "stranger"):
            keys = ("-keyout", self.at(f"{name}.key"), "-out", self.at(f"{name}.pem"))
            _openssl("req", "-x509", *ec, "-subj", f"/CN={name}", "-addext", "keyUsage=critical,keyCertSign,cRLSign", "-days", "2", *keys)
        (folder / "extensions").write_text("subjectAltName=IP:127.0.0.1\nauthorityKeyIdentifier=keyid\n")
        for name in ("server", "alice"):
            _openssl("req", *ec, "-subj", f"/CN={name}", "-keyout", self.at(f"{name}.key"), "-out", self.at(f"{name}.csr"))
            signer = ("-CA", self.at("authority.pem"), "-CAkey", self.at("authority.key"), "-CAcreateserial")
            files = ("-in", self.at(f"{name}.csr"), "-extfile", self.at("extensions"), "-out", self.at(f"{name}.pem"))
            _openssl("x509", "-req", *files, *signer, "-days", "2")
        _openssl("genrsa", "-out", self.at("token.key"), "2048")
        _openssl("rsa", "-in", self.at("token.key"), "-pubout", "-out", self.at("token.pub"))

    def at(self, name: str) -> str:
        return str(self.folder / name)

    def text(self, name: str) -> str:
        return (self.folder / name).read_text()

    def token(self, who: str) -> str:
        head = _base64url(json.dumps({"alg": "RS256", "typ": "JWT"}).encode())
        body = _base64url(json.dumps({"sub": who, "exp": _forever}).encode())
        signature = _openssl("dgst", "-sha256", "-sign", self.at("token.key"), stdin=f"{head}.{body}".encode())
        return f"{head}.{body}.{_base64url(signature)}"


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Keys:
    return Keys(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module")
def locked(keys: Keys) -> Iterator[Server]:
    """A server with TLS, which asks for a certificate and a token."""
    files = ("--tls-cert", keys.at("server.pem"), "--tls-key", keys.at("server.key"))
    running = Server(*files, "--tls-client-ca", keys.at("authority.pem"), "--token-keys", keys.at("token.pub"))
    yield running
    running.stop()


@pytest.fixture
def tls(keys: Keys) -> lpdeform.Tls:
    return lpdeform.Tls(keys.text("authority.pem"), keys.text("alice.pem"), keys.text("alice.key"))


def test_a_certificate_and_a_token_let_in(
    locked: Server, keys: Keys, tls: lpdeform.Tls, make_grid: Callable[[int], Grid]
) -> None:
    shape = make_grid(4)
    asked: list[str] = []

    def token() -> str:
        asked.append(keys.token("alice"))
        return asked[-1]

    with lpdeform.open(shape.vertices, shape.faces, address=locked.address, tls=tls, token=token) as session:
        session.set_handle("left", shape.left)
        session.set_handle("right", shape.right)
        assert session.move("right", translation=[0, 0, 1]).is_final
        assert session.solve().stop_reason == "converged"
        with lpdeform.join(session.name, address=locked.address, tls=tls, token=keys.token("alice")) as reader:
            assert reader.settle().is_final
    assert len(asked) > 3  # of each call


def test_remarks_beside_certificates_may_be_in_any_language(keys: Keys) -> None:
    own = keys.text("alice.pem")
    tls = lpdeform.Tls("# Müllers\n" + keys.text("authority.pem"), "# für Alice\n" + own, keys.text("alice.key"))
    with pytest.raises(lpdeform.Unavailable):
        lpdeform.join("sessions/0", address="localhost:1", tls=tls, call_timeout=20.0)


def test_asyncio_too(locked: Server, keys: Keys, tls: lpdeform.Tls, make_grid: Callable[[int], Grid]) -> None:
    shape = make_grid(4)

    async def components() -> int:
        token = keys.token("alice")
        opening = lpdeform.open_async(shape.vertices, shape.faces, address=locked.address, tls=tls, token=token)
        async with opening as session:
            return session.mesh_report.components

    assert asyncio.run(components()) == 1


def test_who_is_not_let_in_is_told_why(
    locked: Server, keys: Keys, tls: lpdeform.Tls, make_grid: Callable[[int], Grid]
) -> None:
    shape = make_grid(4)

    def reason(tls: lpdeform.Tls | bool, token: str | None) -> str:
        with pytest.raises(lpdeform.LpdeformError) as caught:
            lpdeform.open(shape.vertices, shape.faces, address=locked.address, tls=tls, token=token, call_timeout=20.0)
        return caught.value.reason

    assert reason(tls, None) == "TOKEN_MISSING"
    assert reason(tls, "nonsense") == "TOKEN_INVALID"
    good = keys.token("alice")
    assert reason(False, good) == "NO_SERVER"
    assert reason(lpdeform.Tls(keys.text("stranger.pem"), tls.certificate_chain, tls.private_key), good) == "NO_SERVER"


def test_a_large_mesh_is_opened_however_few_bytes_a_second_the_server_takes(
    keys: Keys, make_grid: Callable[[int], Grid]
) -> None:
    shape = make_grid(500)  # 12 MB, of which 4 MiB may come at once
    limited = Server("--token-keys", keys.at("token.pub"), "--max-upload-rate", "6000000")
    try:
        with lpdeform.open(shape.vertices, shape.faces, address=limited.address, token=keys.token("alice")) as session:
            assert session.mesh_report.vertices == 250_000
    finally:
        limited.stop()


def test_what_cannot_be_used_is_named(keys: Keys) -> None:
    def fault(**how: object) -> tuple[str, str]:
        with pytest.raises(lpdeform.InvalidInput) as caught:
            lpdeform.join("sessions/0", address="localhost:1", **how)  # type: ignore[arg-type]
        return caught.value.reason, caught.value.element

    own, key = keys.text("alice.pem"), keys.text("alice.key")
    assert fault(token="secret\n") == ("TOKEN_CHARACTERS", "token")
    assert fault(tls=lpdeform.Tls("garbage")) == ("TLS_CERTIFICATES", "root_certificates")
    assert fault(tls=lpdeform.Tls(None, "garbage", key)) == ("TLS_CERTIFICATES", "certificate_chain")
    assert fault(tls=lpdeform.Tls(None, own)) == ("TLS_KEY_MISSING", "private_key")
    assert fault(tls=lpdeform.Tls(None, own, own)) == ("TLS_PRIVATE_KEY", "private_key")
    locked = _openssl("pkcs8", "-topk8", "-in", keys.at("alice.key"), "-passout", "pass:secret")
    assert fault(tls=lpdeform.Tls(None, own, locked)) == ("TLS_PRIVATE_KEY", "private_key")
    broken = "-----BEGIN PRIVATE KEY-----\nMIG\n-----END PRIVATE KEY-----\n"
    assert fault(tls=lpdeform.Tls(None, own, broken)) == ("TLS_PRIVATE_KEY", "private_key")
    for other in ("server.key", "token.key"):  # of the same kind, and of another
        assert fault(tls=lpdeform.Tls(None, own, keys.text(other))) == ("TLS_KEY_MISMATCH", "private_key")
    assert key not in repr(lpdeform.Tls(None, own, key))


@pytest.mark.parametrize("address", ["127.0.0.1:105333", "localhost:0", "39797", "http://localhost:50051", "::1:50051", "a:1x", "a:" + 5000 * "9"])
def test_what_is_no_address_is_refused_by_name(address: str) -> None:
    with pytest.raises(lpdeform.InvalidInput) as refused:
        lpdeform.join("sessions/0", address=address)
    assert (refused.value.reason, refused.value.element) == ("ADDRESS_INVALID", address)


def test_a_function_that_fails_is_an_error_and_nothing_is_sent() -> None:
    def fails() -> str:
        raise RuntimeError("the vault is closed")

    for function in (fails, lambda: "secret\n"):
        with pytest.raises(lpdeform.LpdeformError) as caught:
            Caller(function, "name").metadata()
        assert caught.value.reason == "TOKEN_FUNCTION"
        assert "secret" not in str(caught.value)


class _Calls(grpc.GenericRpcHandler):
    """A server that refuses all calls and records their headers."""

    def __init__(self) -> None:
        self.headers: list[str] = []

    def service(self, details: grpc.HandlerCallDetails) -> None:
        self.headers.append(str(dict(details.invocation_metadata)["lpdeform-session"]))


def test_calls_of_one_client_say_the_same_name_for_a_proxy() -> None:
    from lpdeform._rpc import Rpc
    from lpdeform._stop import Stop

    server, calls = grpc.server(futures.ThreadPoolExecutor(1)), _Calls()
    server.add_generic_rpc_handlers((calls,))
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    for _ in range(2):
        rpc = Rpc(f"127.0.0.1:{port}")
        for _ in range(2):
            with pytest.raises(lpdeform.LpdeformError):
                rpc.call("GetSession", service_pb2.GetSessionRequest(), service_pb2.GetSessionResponse, Stop())
        with pytest.raises(grpc.RpcError):
            list(rpc.deform(iter([service_pb2.DeformRequest().SerializeToString()])))
        rpc.close()
    server.stop(None)
    first, second = calls.headers[:3], calls.headers[3:]
    assert len(set(first)) == len(set(second)) == 1
    assert first[0] != second[0]
