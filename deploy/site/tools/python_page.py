#!/usr/bin/env python3
"""Prints the page of the Python package, with every name that it exports."""

import inspect

import lpdeform

GROUPS = {
    "In one call": ("deform",),
    "Open a session": ("open", "join", "restore", "open_async", "join_async", "restore_async", "Tls"),
    "Sessions": ("Session", "AsyncSession"),
    "Handles": ("Handle", "Fixed", "RigidMotion", "Targets", "Resize", "Exact", "Soft", "Orientation", "AxisLock", "PlaneLock",
                "SurfacePoints", "Removal", "Update"),
    "Settings": ("Settings", "SolverSettings", "MinimaSearch", "Automatic"),
    "Results": ("Frame", "SolveResult", "IterationRecord", "SolveProgress", "MeshReport", "Defect", "Notice", "BetterShape",
                "QuantizedSurface", "FrameAssembly"),
    "Mesh files": ("read_mesh", "write_mesh", "MeshFile", "MeshPart"),
    "Errors": ("LpdeformError", "InvalidInput", "Unavailable", "Timeout", "Code", "Reason", "SplitMeshWarning"),
}
HEAD = """# Python

The package `lpdeform`: NumPy arrays in, NumPy arrays out. [Install](../install.md) has a first program, and the
[notebooks](../notebooks/sheet.md) longer ones.
"""


def documented(name):
    kind = "class" if inspect.isclass(getattr(lpdeform, name)) else "function" if callable(getattr(lpdeform, name)) else "data"
    return f".. auto{kind}:: lpdeform.{name}\n"


print(HEAD)
listed = [name for names in GROUPS.values() for name in names]
others = [name for name in lpdeform.__all__ if name not in listed]
for title, names in {**GROUPS, **({"More": others} if others else {})}.items():
    entries = "\n".join(documented(name) for name in names if name in lpdeform.__all__)
    print(f"## {title}\n\n```{{eval-rst}}\n{entries}```\n")
