"""The package lpdeform, where it can be imported, and where the server is."""

import os

import bpy

try:
    import lpdeform
except ImportError as missing:
    lpdeform = None
    _missing = str(missing)


class NotReady(Exception):
    """What a person has to do first, in one sentence."""


def require() -> None:
    if lpdeform is None:
        raise NotReady(
            f"The Python package of lpdeform cannot be used ({_missing}). With Debian's Blender install python3-grpcio and "
            "python3-protobuf; otherwise use the add-on that is packed with --with-grpc."
        )


def address() -> str:
    preferences = bpy.context.preferences.addons.get(__package__)
    given = preferences.preferences.address if preferences is not None else ""
    return given or os.environ.get("LPDEFORM_ADDRESS") or "localhost:50051"
