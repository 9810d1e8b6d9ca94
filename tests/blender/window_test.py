"""What needs a window: strokes of Blender's own brush, Escape, and a picture of the sidebar. Blender's events are simulated.
tests/blender/run --window window_test.py"""

import os
import sys
import time
import traceback
from unittest import mock

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import live, surface  # noqa: E402


PATIENCE = 5 * stage.PATIENCE  # Mesa draws on the processor


def wait_until(is_done, what):
    """For `yield from`: lets Blender go on until it is so."""
    deadline = time.monotonic() + PATIENCE
    while not is_done():
        assert time.monotonic() < deadline, what
        yield


def pause(seconds):
    until = time.monotonic() + seconds
    yield from wait_until(lambda: time.monotonic() > until, "")


class View:
    """The 3D view of the window."""

    def __init__(self):
        self.window = bpy.context.window_manager.windows[0]
        self.area = next(one for one in self.window.screen.areas if one.type == "VIEW_3D")
        self.region = next(one for one in self.area.regions if one.type == "WINDOW")

    def context(self):
        return bpy.context.temp_override(window=self.window, area=self.area, region=self.region)

    def at(self, x, y):
        """A point of the view, by its shares."""
        return int(self.region.x + x * self.region.width), int(self.region.y + y * self.region.height)

    def event(self, kind, value, x=0.5, y=0.5, **modifiers):
        at = self.at(x, y)
        self.window.event_simulate(type=kind, value=value, x=at[0], y=at[1], **modifiers)

    def picture(self, path):
        """Saves what the screen shows of the view, and returns its colours, height x width x 3, from below. Blender's own
        screenshots are black here from 4.3 on."""
        with open(os.path.join(os.environ["LPDEFORM_SCREEN"], "Xvfb_screen0"), "rb") as file:  # in the format of xwd
            data = file.read()
        header = np.frombuffer(data, ">u4", 25)
        size, width, height, line, palette = (int(header[at]) for at in (0, 4, 5, 12, 19))
        rows = np.frombuffer(data, np.uint8, line * height, size + 12 * palette).reshape(height, line)
        screen = rows[::-1, : 4 * width].reshape(height, width, 4)[:, :, 2::-1]  # of blue, green, red and nothing
        below = self.area.y + height - self.window.height
        shown = screen[below : below + self.area.height, self.area.x : self.area.x + self.area.width] / 255
        image = bpy.data.images.new("screen", shown.shape[1], shown.shape[0])
        image.pixels.foreach_set(np.dstack([shown, np.ones(shown.shape[:2])]).astype(np.float32).ravel())
        image.filepath_raw, image.file_format = path, "PNG"
        image.save()
        return shown

    def bake(self):
        """As the button does."""
        with self.context():
            assert bpy.ops.lpdeform.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def live_tube(view):
    for ob in list(bpy.data.objects):
        live.stop(ob)
        bpy.data.objects.remove(ob)
    tube = stage.tube(around=32, along=81)
    rest = stage.at_rest(tube)
    with view.context():
        stage.add_handle(tube, np.flatnonzero(rest[:, 2] < 0.3))
        tip = stage.add_handle(tube, np.flatnonzero(rest[:, 2] > 3.7))
        stage.activate(tube)
        assert bpy.ops.lpdeform.start() == {"FINISHED"}
    yield from wait_until(lambda: live.of(tube).frame is not None, "no frame came")
    return tube, tip


def test_weights_are_read_when_a_stroke_ends_and_only_then(view):
    tube, _ = yield from live_tube(view)
    tube.vertex_groups.new(name="soft")
    tube.lpdeform.p_group, tube.lpdeform.p_painted = "soft", 1.0
    with view.context():
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
        if bpy.context.tool_settings.weight_paint.brush is None:  # in Debian's 4.3, which is packed without Blender's assets
            bpy.data.brushes.new("Paint", mode="WEIGHT_PAINT").asset_mark()
            bpy.ops.brush.asset_activate(asset_library_type="LOCAL", relative_asset_identifier="Brush/Paint")
        bpy.ops.ed.undo_push(message="Set up")
    yield from pause(1)
    with mock.patch.object(live.surface, "group_weights", wraps=surface.group_weights) as reads:

        def count():
            return [call.args[1] for call in reads.call_args_list].count("soft")

        yield from pause(3)
        assert count() == 0, f"{count()} reads while nothing is painted"
        view.event("MOUSEMOVE", "NOTHING", 0.5, 0.4)
        view.event("LEFTMOUSE", "PRESS", 0.5, 0.4)
        for step in range(8):
            view.event("MOUSEMOVE", "NOTHING", 0.5, 0.4 + 0.02 * step)
            yield from pause(0.02)
        yield from pause(1)  # held still
        assert count() == 0, f"{count()} reads during the stroke"
        view.event("LEFTMOUSE", "RELEASE", 0.5, 0.54)
        yield from wait_until(lambda: count() > 0, "the stroke was not read")
        yield from pause(3)
        assert count() == 1, f"{count()} reads after the stroke"
        assert live.of(tube)._weights["p"].max() > 0.5
        view.event("Z", "PRESS", ctrl=True)
        view.event("Z", "RELEASE")
        yield from wait_until(lambda: count() > 1 and not live.of(bpy.data.objects["tube"])._weights["p"].any(), "undo was not read")
    with view.context():
        bpy.ops.object.mode_set(mode="OBJECT")


def test_escape_ends_a_bake_and_leaves_everything_as_it_was(view):
    tube, tip = yield from live_tube(view)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 40
    for frame, x in ((1, 0.0), (40, 2.0)):
        tip.location.x = x
        tip.keyframe_insert("location", frame=frame)
    scene.frame_set(7)
    keys = tube.data.shape_keys.key_blocks.keys()
    view.bake()
    yield from wait_until(lambda: scene.frame_current == 4, "it does not go on")
    assert live.of(tube).is_baked
    view.event("ESC", "PRESS")
    view.event("ESC", "RELEASE")
    yield from wait_until(lambda: not live.of(tube).is_baked, "Escape did not end it")
    yield from pause(0.5)
    assert scene.frame_current == 7
    assert tube.data.shape_keys.key_blocks.keys() == keys
    assert tube.data.shape_keys.animation_data is None
    scene.frame_end = 6
    view.bake()
    yield from wait_until(lambda: live.of(tube) is None, "it does not end")
    assert len(tube.data.shape_keys.key_blocks) == 7


def test_the_sidebar_and_a_live_mesh_as_a_picture(view):
    tube, tip = yield from live_tube(view)
    tube.lpdeform.p, tube.lpdeform.certify = 1.5, True
    with view.context():
        live.stop(tube)
        assert bpy.ops.lpdeform.start() == {"FINISHED"}
        stage.activate(tip)
    tube.data.polygons.foreach_set("use_smooth", np.ones(len(tube.data.polygons), bool))
    tip.matrix_world = Matrix.Translation((0.8, 0, -0.4)) @ tip.matrix_world @ Matrix.Rotation(0.8, 4, "Y")
    space = view.area.spaces.active
    space.show_region_ui, space.shading.color_type = True, "VERTEX"
    with view.context():
        bpy.ops.view3d.view_all()
    yield from pause(1)
    sidebar = next(one for one in view.area.regions if one.type == "UI")
    if bpy.app.version >= (4, 2, 0):
        sidebar.active_panel_category = "lpdeform"
    else:  # its tab is the fourth from above
        at = {"x": sidebar.x + sidebar.width - 8, "y": sidebar.y + sidebar.height - 180}
        view.window.event_simulate(type="MOUSEMOVE", value="NOTHING", **at)
        yield from pause(0.2)
        view.window.event_simulate(type="LEFTMOUSE", value="PRESS", **at)
        view.window.event_simulate(type="LEFTMOUSE", value="RELEASE", **at)
    view.event("MOUSEMOVE", "NOTHING")
    yield from wait_until(lambda: live.of(tube).proof, "no bound came")
    yield from pause(2)
    colours = view.picture(os.path.join(stage.PICTURES, "live.png"))
    red, _, blue = np.moveaxis(colours, 2, 0)
    assert np.mean((blue > 0.15) & (blue > 2 * red)) > 0.01, "the mesh is not shown with its colours"


def run(tests):
    view = View()
    for test in tests:
        print(test.__name__, flush=True)
        yield from test(view)
        print("ok", flush=True)


def main():
    tests = [value for name, value in globals().items() if name.startswith("test_")]
    bpy.context.preferences.view.show_splash = False  # it would take the events
    server = stage.RunningServer()
    stage.clear()
    stage.preferences().address = server.address
    steps = run(tests)

    def end(how, code):
        print(f"Ran {len(tests)} tests\n\n{how}", flush=True)
        server.end()
        os._exit(code)  # Blender would ask whether to save

    def turn():
        """A timer of Blender: its window goes on meanwhile."""
        try:
            next(steps)
        except StopIteration:
            end("OK", 0)
        except Exception:
            traceback.print_exc()
            end("FAILED (errors=1)", 1)
        return 0.01

    bpy.app.timers.register(turn, first_interval=1.0, persistent=True)


main()
