"""How long the add-on takes for a frame of 50,625 vertices: the whole tick and its parts, with ShapeKey.points, as the add-on
writes positions where Blender has them, and with ShapeKey.data.   tests/blender/run tick_bench.py"""

import os
import statistics
import sys
import time
from unittest import mock

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import live, surface  # noqa: E402

SIDE, TICKS = 225, 60


def sheet():
    """SIDE x SIDE vertices."""
    across = np.linspace(0, 1, SIDE)
    vertices = np.stack([*np.meshgrid(across, across), np.zeros((SIDE, SIDE))], axis=-1).reshape(-1, 3)
    row = np.arange(SIDE - 1)
    corner = (SIDE * row[:, None] + row).ravel()
    mesh = bpy.data.meshes.new("sheet")
    mesh.from_pydata(vertices.tolist(), [], np.stack([corner, corner + 1, corner + SIDE + 1, corner + SIDE], axis=1).tolist())
    ob = bpy.data.objects.new("sheet", mesh)
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.update()
    return ob


def milliseconds(call):
    start = time.perf_counter()
    call()
    return 1000 * (time.perf_counter() - start)


def measure(ob, frame, name):
    """Medians over ticks in each of which a new frame has come."""
    running, key = live.of(ob), surface.live_key(ob)
    points = surface._points(key)
    flat = np.ascontiguousarray(frame.positions, np.float32).reshape(-1)
    times = {"tick": [], "positions": [], "colours": [], "evaluation": []}
    for _ in range(TICKS):
        running.frame = None  # so that the same frame is a new one
        with mock.patch.object(running.session, "poll", lambda: frame):
            times["tick"].append(milliseconds(live.tick))
        times["positions"].append(milliseconds(lambda: points.foreach_set("co", flat)))
        times["colours"].append(milliseconds(lambda: surface.show_distortion(ob, frame.distortion, 0.0)))
        ob.data.update_tag()
        times["evaluation"].append(milliseconds(bpy.context.view_layer.update))
    print(f"| {bpy.app.version_string} | {name} | " + " | ".join(f"{statistics.median(one):.1f}" for one in times.values()) + " |")


def main():
    server = stage.RunningServer()
    stage.clear()
    stage.preferences().address = server.address
    ob = sheet()
    rest = stage.at_rest(ob)
    stage.add_handle(ob, np.flatnonzero(rest[:, 0] < 0.05))
    tip = stage.add_handle(ob, np.flatnonzero(rest[:, 0] > 0.95))
    bpy.ops.lpdeform.start()
    tip.matrix_world = Matrix.Translation((-0.2, 0, 0.3)) @ tip.matrix_world
    stage.settle(ob)
    frame = live.of(ob).frame
    print("| Blender | writes to | tick, ms | positions | colours | evaluation |\n|---|---|---|---|---|---|")
    if hasattr(surface.live_key(ob), "points"):
        measure(ob, frame, "points")
    with mock.patch.object(surface, "_points", lambda key: key.data):
        measure(ob, frame, "data")
    live.stop(ob)
    server.end()


main()
