"""The package lpdeform, what it needs to reach a server, and the server's address."""

import os
import re

import bpy
import lpdeform


class NotReady(Exception):
    """What the user has to do first, in one sentence."""


def require() -> None:
    try:
        import google.protobuf  # noqa: F401
        import grpc  # noqa: F401
    except ImportError as missing:
        raise NotReady(
            f"grpcio and protobuf cannot be used ({missing}). With Debian's Blender install python3-grpcio and python3-protobuf; "
            "otherwise use Blender 4.2 or newer and the extension that client/blender/package --for packs."
        ) from missing
    if not getattr(bpy.app, "online_access", True) and not _is_on_this_machine(address()):
        raise NotReady(
            f"Blender may not go online, and {address()} is another machine. Allow online access in Preferences > System, or use a server "
            "on this machine."
        )


def _is_on_this_machine(server: str) -> bool:
    return re.match(r"(localhost|127(\.\d+){3}|\[::1\]):|unix:", server) is not None


def _preference(name: str):
    addon = bpy.context.preferences.addons.get(__package__)
    return getattr(addon.preferences, name) if addon is not None else None


def address() -> str:
    return _preference("address") or os.environ.get("LPDEFORM_ADDRESS") or "localhost:50051"


def access() -> dict:
    """The token and TLS settings of the preferences, for lpdeform.open(). Raises OSError if a file cannot be read."""
    path = _path("token_file")  # read here, because bpy is for this thread only
    token = (lambda: _text(path).strip()) if path else None  # read for each call, so that the token may be renewed
    if token is not None:
        token()
    if not _preference("use_tls"):
        return {"token": token, "tls": False}
    files = ("root_certificates", "certificate_chain", "private_key")
    texts = {name: _text(_path(name)) for name in files if _path(name)}
    return {"token": token, "tls": lpdeform.Tls(**texts)}


def _path(name: str) -> str:
    """The contents of a file that the preferences name; empty if none is named."""
    given = _preference(name)
    return bpy.path.abspath(given) if given else ""


def _text(path: str) -> str:
    with open(path, encoding="ascii", errors="replace") as file:
        return file.read()
