"""lpdeform in Blender: select vertices in Edit mode, add a handle, move its empty, and the mesh follows live."""

import sys
from pathlib import Path

bl_info = {
    "name": "lpdeform",
    "description": "Deform meshes live by handles on an lpdeform server, with p and stiffness as properties and paint",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > lpdeform",
    "category": "Mesh",
}

# Blender 4.2 and newer install the wheels of an extension. Older ones import the package lpdeform from its wheel as it is.
if not __package__.startswith("bl_ext."):
    sys.path.extend(map(str, (Path(__file__).parent / "wheels").glob("lpdeform-*.whl")))

from . import live, operators, panel, properties  # noqa: E402  (need the path)

_parts = (properties, operators, panel, live)


def register() -> None:
    for part in _parts:
        part.register()


def unregister() -> None:
    for part in reversed(_parts):
        part.unregister()
