"""Authentication and routing: bearer tokens, TLS, and the header by which a proxy keeps a client's calls together."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from lpdeform.errors import Code, invalid, make

_SCHEMES = ("unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "xds:", "vsock:")

Token: TypeAlias = str | Callable[[], str] | None
"""A bearer token, or a function that returns the newest one, called on any thread when a call begins; None: no token."""


@dataclass(frozen=True)
class Tls:
    """How to connect with TLS. Texts or bytes in PEM."""

    root_certificates: str | bytes | None = None
    """The certificates to trust; None: those that gRPC trusts by default."""
    certificate_chain: str | bytes | None = None
    """The client's own, if the server asks for one."""
    private_key: str | bytes | None = None

    def __repr__(self) -> str:
        """Without the key."""
        return f"<Tls{' with a certificate' if self.certificate_chain else ''}>"


class Caller:
    """What every call over a connection says of its caller."""

    route: str
    """A proxy in front of several servers sends all calls with the same value to one of them."""

    def __init__(self, token: Token, route: str) -> None:
        """`route`: any value, the same for all calls of one client. Raises InvalidInput TOKEN_CHARACTERS."""
        if isinstance(token, str) and not is_header_text(token):
            text = "The token has a character that a header cannot carry; a line break at its end, perhaps."
            raise invalid(text, "TOKEN_CHARACTERS", "token", "printable ASCII")
        self._token = token
        self.route = route

    def metadata(self) -> list[tuple[str, str]]:
        """Raises UNAUTHENTICATED TOKEN_FUNCTION if the caller's function does not return a token that a header can carry."""
        found = [("lpdeform-session", self.route)]
        if token := self._newest():
            found.append(("authorization", f"Bearer {token}"))
        return found

    def _newest(self) -> str | None:
        if not callable(self._token):
            return self._token
        try:
            token = self._token()
        except Exception as error:
            raise make(Code.UNAUTHENTICATED, f"The function of the token failed: {error!r}", "TOKEN_FUNCTION") from error
        if not isinstance(token, str) or not is_header_text(token):
            text = "The function of the token gave something that a header cannot carry."
            raise make(Code.UNAUTHENTICATED, text, "TOKEN_FUNCTION")
        return token


def is_header_text(text: str) -> bool:
    return all(" " <= letter <= "~" for letter in text)


def open_channel(address: str, tls: Tls | bool, options: list[tuple[str, int]]) -> Any:
    """Raises InvalidInput if a text of `tls` cannot be used: gRPC would only report that it cannot connect."""
    import grpc

    _check_address(address)
    if tls is False:
        return grpc.insecure_channel(address, options=options)
    given = tls if isinstance(tls, Tls) else Tls()
    roots, chain, key = map(_bytes, (given.root_certificates, given.certificate_chain, given.private_key))
    for name, text in (("root_certificates", roots), ("certificate_chain", chain)):
        if text is not None:
            _check_certificates(name, text)
    if (chain is None) != (key is None):
        missing = "private_key" if key is None else "certificate_chain"
        why = "A certificate chain and a private key belong together; one of them is missing."
        raise invalid(why, "TLS_KEY_MISSING", missing)
    if chain is not None and key is not None:
        _check_own(chain, key)
    return grpc.secure_channel(address, grpc.ssl_channel_credentials(roots, key, chain), options=options)


def _check_address(address: str) -> None:
    """Checks the port: without this, a port above 65535 would reach another one."""
    if address.startswith(_SCHEMES):
        return  # gRPC checks these itself
    host, colon, port = address.rpartition(":")
    is_host = host != "" and "/" not in host and (":" not in host or (host[0] == "[" and host[-1] == "]"))
    if not (colon and is_host and port.isascii() and port.isdigit() and len(port) <= 5 and 1 <= int(port) <= 65535):
        text = f'"{address}" is no address of a server: that is HOST:PORT, with a port from 1 to 65535, or unix:PATH.'
        raise invalid(text, "ADDRESS_INVALID", address, "HOST:PORT or unix:PATH, port = 1 to 65535")


def _bytes(text: str | bytes | None) -> bytes | None:
    return text.encode() if isinstance(text, str) else text


def _check_certificates(name: str, text: bytes) -> None:
    import ssl

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(cadata=text.decode("ascii", errors="ignore"))
    except (ssl.SSLError, ValueError) as error:
        raise invalid(f"{name} cannot be read: {error}", "TLS_CERTIFICATES", name, "PEM") from None


def _check_own(chain: bytes, key: bytes) -> None:
    import ssl
    import tempfile

    if b"PRIVATE KEY-----" not in key:
        raise invalid("private_key is no private key in PEM.", "TLS_PRIVATE_KEY", "private_key", "PEM, without a password")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.set_ciphers("DEFAULT:@SECLEVEL=0")  # the server decides which keys are strong enough
    with tempfile.TemporaryDirectory() as folder:  # readable by this user alone, because Python's ssl reads no key from memory
        try:
            own, secret = _kept(folder, "certificate_chain", chain), _kept(folder, "private_key", key)
            context.load_cert_chain(own, secret, password=lambda: "")  # instead of asking on the terminal
        except ssl.SSLError as error:
            if error.reason in ("KEY_VALUES_MISMATCH", "KEY_TYPE_MISMATCH", "NO_CERTIFICATE_ASSIGNED"):
                text = "private_key is not that of the first certificate of certificate_chain."
                raise invalid(text, "TLS_KEY_MISMATCH", "private_key") from None
            text = "private_key is not a PEM private key, or it has a password."
            raise invalid(text, "TLS_PRIVATE_KEY", "private_key", "PEM, without a password") from None


def _kept(folder: str, name: str, text: bytes) -> str:
    path = os.path.join(folder, name)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(text)
    return path
