"""Solves frame after frame of the scene, and keeps the results as shape keys with keyframes, so that a render follows."""

import time

import bpy
import numpy as np

from . import live, surface
from .client import NotReady

_prefix = "lpdeform frame "
_most_frames = 10_000  # Blender numbers the shape keys of an object by 16 bits
_patience = 0.05  # seconds that a step waits
_longest_start = 60  # seconds until the server has answered for the first time


class Baking:
    """A live mesh on its way through the frames. Nothing is kept before finish(); without it, cancel() puts everything back."""

    def __init__(self, ob, frames: range) -> None:
        """Raises NotReady, and then changes nothing."""
        if not 1 <= len(frames) <= _most_frames:
            raise NotReady(f"The range has {len(frames)} frames; it takes from 1 to {_most_frames}.")
        running = live.of(ob)
        if running.has_refusals:
            raise NotReady(f"The server refuses something: {live.message(ob)}")
        self._name, self._frames, self._scene = ob.name, frames, bpy.context.scene
        self._before = self._scene.frame_current, self._scene.frame_subframe
        self._shapes: list = []
        self._deadline = time.monotonic() + _longest_start
        running.is_baked = True
        self._scene.frame_set(frames[0])

    @property
    def said(self) -> str:
        """How far it is."""
        return f"lpdeform: frame {len(self._shapes) + 1} of {len(self._frames)}. Escape ends it and changes nothing."

    @property
    def done(self) -> int:
        return len(self._shapes)

    def step(self) -> bool:
        """Waits a moment for the finished result of the present frame, and goes on to the next one if it is there. Returns whether
        there is no next one. Raises NotReady and the server's errors."""
        ob = self._ob()
        running = live.of(ob)
        if running is None:
            raise NotReady("The mesh, or its session, is gone.")
        running.look(ob)
        if running.state != "connected" and (running.frame is not None or time.monotonic() > self._deadline):
            raise NotReady(f"The server went away at frame {self._frames[self.done]}.")
        result = running.finished(ob, _patience)
        if result is not None:
            self._shapes.append(np.array(result.positions, np.float32))
            if self.done < len(self._frames):
                self._scene.frame_set(self._frames[self.done])
        return self.done == len(self._frames)

    def cancel(self) -> None:
        """Goes back to the frame where it began. The mesh stays live."""
        self._scene.frame_set(self._before[0], subframe=self._before[1])
        running = live.of(self._ob())
        if running is not None:
            running.is_baked = False

    def finish(self) -> None:
        """Ends the live session, and lets the mesh follow the results of all frames. Those of an earlier time are replaced."""
        ob = self._ob()
        live.stop(ob, stay_muted=True)
        _remove_earlier(ob)
        if ob.data.shape_keys is None:
            ob.shape_key_add(name="Basis", from_mix=False)
        for at, shape in enumerate(self._shapes):
            key = ob.shape_key_add(name=f"{_prefix}{self._frames[at]}", from_mix=False)
            surface.set_positions(key, shape)
            for near in range(max(at - 1, 0), min(at + 2, len(self._frames))):
                key.value = float(near == at)
                key.keyframe_insert("value", frame=self._frames[near])
        for curve in _curves(ob.data.shape_keys):
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"
        self._scene.frame_set(self._before[0], subframe=self._before[1])

    def _ob(self):
        return bpy.data.objects.get(self._name)


def _remove_earlier(ob) -> None:
    keys = ob.data.shape_keys
    if keys is None:
        return
    for curve in _curves(keys):
        _all_curves(keys).remove(curve)
    for key in [one for one in keys.key_blocks if one.name.startswith(_prefix)]:
        ob.shape_key_remove(key)


def _curves(keys) -> list:
    """Those of baked frames."""
    return [one for one in _all_curves(keys) if one.data_path.startswith(f'key_blocks["{_prefix}')]


def _all_curves(keys):
    animation = keys.animation_data
    if animation is None or animation.action is None:
        return []
    if bpy.app.version < (4, 4, 0):
        return animation.action.fcurves
    bags = [strip.channelbag(animation.action_slot) for layer in animation.action.layers for strip in layer.strips]
    return next((bag.fcurves for bag in bags if bag is not None), [])
