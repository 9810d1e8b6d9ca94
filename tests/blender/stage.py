"""Shared by the tests in Blender: the add-on installed from its zip, a server, shapes, and a function that runs Blender's timers,
which do not run by themselves without a window.

Run as: blender ... --python TEST.py -- ADD_ON.zip SERVER PICTURES, or with the module bpy: python TEST.py -- ADD_ON.zip ...
"""

import base64
import json
import os
import signal
import subprocess
import sys
import time
import unittest

import bpy
import numpy as np

ADD_ON, SERVER, PICTURES = sys.argv[sys.argv.index("--") + 1 :]
IS_EXTENSION = bpy.app.version >= (4, 2, 0)
MODULE = "bl_ext.user_default.lpdeform" if IS_EXTENSION else "lpdeform_addon"
PATIENCE = 60.0  # seconds that anything may take; never reached where all is well


class RunningServer:
    """lpdeform-server on a free port of this machine, which it keeps when it is started again."""

    def __init__(self, *flags):
        self.address = "127.0.0.1:0"
        self._flags = flags
        self.start()

    def start(self):
        command = [SERVER, "--address", self.address, "--log-level", "off", *self._flags]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.address = self._process.stdout.readline().split()[-1]

    def end(self, how=signal.SIGTERM):
        self._process.send_signal(how)
        self._process.wait(PATIENCE)
        self._process.stdout.close()


def openssl(*arguments, data=b""):
    return subprocess.run(["openssl", *arguments], input=data, capture_output=True, timeout=PATIENCE, check=True).stdout


def token_of(subject, key):
    """A JWT for the next hour, signed with the RSA key of this file."""
    parts = ({"alg": "RS256", "typ": "JWT"}, {"sub": subject, "exp": int(time.time()) + 3600})
    text = b".".join(base64.urlsafe_b64encode(json.dumps(part).encode()).rstrip(b"=") for part in parts)
    signature = base64.urlsafe_b64encode(openssl("dgst", "-sha256", "-sign", key, data=text)).rstrip(b"=")
    return (text + b"." + signature).decode()


def install():
    """Enables the add-on, for `from lpdeform_addon import ...`, and returns its preferences."""
    if IS_EXTENSION:  # tests/blender/run has installed it in a program
        if not bpy.app.binary_path:  # the module bpy, which has no command line and keeps no preferences
            bpy.ops.extensions.package_install_files(filepath=ADD_ON, repo="user_default", enable_on_install=True)
        sys.modules["lpdeform_addon"] = sys.modules[MODULE]
    else:
        bpy.ops.preferences.addon_install(filepath=ADD_ON)
        bpy.ops.preferences.addon_enable(module=MODULE)
    return preferences()


def preferences():
    return bpy.context.preferences.addons[MODULE].preferences


def clear():
    """An empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)


def tube(name="tube", around=24, along=61, radius=0.4, length=4.0, at=(0.0, 0.0, 0.0)):
    """A closed tube along z: quads, and a polygon of `around` corners at each end."""
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    height = np.linspace(0, length, along)
    vertices = np.concatenate([np.tile(ring, (along, 1)), np.repeat(height, around)[:, None]], axis=1)
    corner = np.arange(around)
    quads = [(k * around + a, k * around + b, (k + 1) * around + b, (k + 1) * around + a)
             for k in range(along - 1) for a, b in zip(corner, np.roll(corner, -1))]
    last = (along - 1) * around
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], [*quads, corner[::-1].tolist(), (last + corner).tolist()])
    ob = bpy.data.objects.new(name, mesh)
    ob.location = at
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.update()
    return ob


def select(ob, vertices, faces=()):
    """As a person does in Edit mode, where it is left."""
    activate(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")  # Blender 5.0.1 crashes where a script sets `select` of edges
    bpy.ops.object.mode_set(mode="OBJECT")
    mask = np.zeros(len(ob.data.vertices), bool)
    mask[vertices] = True
    for face in faces:
        ob.data.polygons[face].select = True
        mask[list(ob.data.polygons[face].vertices)] = True
    ob.data.vertices.foreach_set("select", mask)
    bpy.ops.object.mode_set(mode="EDIT")


def activate(ob):
    for one in bpy.context.selected_objects:
        one.select_set(False)
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob


def add_handle(ob, vertices, faces=()):
    select(ob, vertices, faces)
    assert bpy.ops.lpdeform.add_handle(in_faces=len(faces) > 0) == {"FINISHED"}
    return bpy.context.object


def shown(ob):
    """n x 3: what Blender draws, in the object's own space."""
    bpy.context.view_layer.update()
    mesh = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def at_rest(ob):
    positions = np.empty(3 * len(ob.data.vertices), np.float32)
    ob.data.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def turn(is_done):
    """Turns the add-on's timer until `is_done` holds."""
    from lpdeform_addon import live

    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        bpy.context.view_layer.update()
        live.tick()
        if is_done():
            return
        for running in live._running.values():
            box = running.session._link.box
            box.wait(time.monotonic() + 0.05, box.takes)
            break
    raise AssertionError("it did not happen in time")


def settle(*obs):
    """Until each mesh shows the result for what its handles and settings are now."""
    from lpdeform_addon import live

    def is_settled():
        frames = [(live.of(ob), live.of(ob).frame) for ob in obs]
        return all(frame is not None and running.session._link.is_result(frame) for running, frame in frames)

    bpy.context.view_layer.update()
    live.tick()
    turn(is_settled)


def main():
    done = unittest.main(module="__main__", argv=["blender"], verbosity=2, exit=False)
    if not done.result.wasSuccessful() or done.result.testsRun == 0:
        raise RuntimeError("tests failed")  # Blender ends with 1
