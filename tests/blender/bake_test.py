"""Frames of an animation that are solved one after the other and kept, so that a render needs no server."""

import os
import signal
import sys
import unittest

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import bake, live  # noqa: E402

FRAMES = range(3, 8)
CLOSE = 1e-3  # of a tube of length 4: two solves that have converged differ by less


class Baking(unittest.TestCase):
    def setUp(self):
        self.server = stage.RunningServer()
        self.addCleanup(self.server.end)
        stage.clear()
        stage.preferences().address = self.server.address
        self.scene = bpy.context.scene
        self.scene.frame_start, self.scene.frame_end = FRAMES[0], FRAMES[-1]
        self.tube = stage.tube()
        self.rest = stage.at_rest(self.tube)
        stage.add_handle(self.tube, np.flatnonzero(self.rest[:, 2] < 0.3))
        self.tip = stage.add_handle(self.tube, np.flatnonzero(self.rest[:, 2] > 3.7))
        home = self.tip.matrix_world.copy()
        for at, frame in enumerate(FRAMES):  # aside and down, turned
            self.tip.matrix_world = Matrix.Translation((0.4 * at, 0, -0.1 * at)) @ home @ Matrix.Rotation(0.2 * at, 4, "Y")
            for path in ("location", "rotation_euler"):
                self.tip.keyframe_insert(path, frame=frame)
        self.scene.frame_set(5, subframe=0.25)
        stage.activate(self.tube)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        stage.settle(self.tube)

    def tearDown(self):
        for name in list(live._running):
            live.stop(bpy.data.objects[name])

    def solved(self):
        """For each frame what Solve shows there."""
        shapes = {}
        for frame in FRAMES:
            self.scene.frame_set(frame)
            self.assertEqual(bpy.ops.lpdeform.solve(), {"FINISHED"})
            shapes[frame] = stage.shown(self.tube)
        self.scene.frame_set(5, subframe=0.25)
        stage.settle(self.tube)
        return shapes

    def shown(self, frame):
        self.scene.frame_set(frame)
        return stage.shown(self.tube)

    def state(self):
        """What a bake that ends early has to leave."""
        keys = self.tube.data.shape_keys
        return (self.scene.frame_current_final, keys.key_blocks.keys(), [one.mute for one in keys.key_blocks], keys.animation_data,
                len(bpy.data.actions), live.of(self.tube) is not None)

    def test_each_frame_is_its_solve_without_a_server(self):
        solved = self.solved()
        self.assertEqual(bpy.ops.lpdeform.bake(), {"FINISHED"})
        self.server.end()
        self.addCleanup(self.server.start)
        self.assertIsNone(live.of(self.tube))
        self.assertAlmostEqual(self.scene.frame_current_final, 5.25)
        for frame, positions in solved.items():
            self.assertLess(np.abs(self.shown(frame) - positions).max(), CLOSE, frame)
        self.assertGreater(np.abs(solved[FRAMES[-1]] - solved[FRAMES[0]]).max(), 1.5)
        self.scene.frame_set(4, subframe=0.25)  # a straight line between two frames
        self.assertLess(np.abs(stage.shown(self.tube) - (0.75 * solved[4] + 0.25 * solved[5])).max(), CLOSE)
        self.assertLess(np.abs(self.shown(1) - solved[FRAMES[0]]).max(), CLOSE)
        self.assertLess(np.abs(self.shown(99) - solved[FRAMES[-1]]).max(), CLOSE)
        self.assertTrue(np.array_equal(stage.at_rest(self.tube), self.rest))

    def test_a_render_follows_without_a_server(self):
        last = self.solved()[FRAMES[-1]]
        self.assertEqual(bpy.ops.lpdeform.bake(), {"FINISHED"})
        self.server.end()
        self.addCleanup(self.server.start)
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location, camera.rotation_euler = (0.8, -9, 2), (np.pi / 2, 0, 0)
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        sky = self.scene.world = bpy.data.worlds.new("world")
        sky.color = (1, 1, 1)
        self.tube.data.materials.append(bpy.data.materials.new("plain"))
        self.tube.data.materials[0].diffuse_color = (0, 0, 0, 1)
        first, baked = self.rendered(FRAMES[0]), self.rendered(FRAMES[-1])
        solved = bpy.data.meshes.new("solved")
        solved.from_pydata(last.tolist(), [], [list(face.vertices) for face in self.tube.data.polygons])
        self.tube.hide_render = True
        self.scene.collection.objects.link(bpy.data.objects.new("solved", solved))
        expected = self.rendered(FRAMES[0])
        self.assertLess(np.mean(baked != expected), 0.005)  # but for pixels at its border
        self.assertGreater(np.mean(first != expected), 0.05)

    def rendered(self, frame):
        """Which pixels the mesh covers."""
        self.scene.frame_set(frame)
        self.scene.render.engine, self.scene.cycles.samples, self.scene.cycles.use_denoising = "CYCLES", 1, False
        self.scene.render.film_transparent = True
        self.scene.render.resolution_x, self.scene.render.resolution_y, self.scene.render.resolution_percentage = 96, 96, 100
        self.scene.render.image_settings.color_mode = "RGBA"
        self.scene.render.filepath = path = os.path.join(bpy.app.tempdir, "frame.png")
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(path, check_existing=False)
        pixels = np.empty(4 * 96 * 96, np.float32)
        picture.pixels.foreach_get(pixels)
        covered = pixels[3::4] > 0.5
        self.assertGreater(np.mean(covered), 0.02)
        return covered

    def test_what_is_cancelled_leaves_everything_as_it_was(self):
        before, shape = self.state(), stage.shown(self.tube)
        baking = bake.Baking(self.tube, FRAMES)
        while baking.done < 3:
            self.assertFalse(baking.step())
        self.assertEqual(self.scene.frame_current, FRAMES[3])
        self.assertEqual(live.tick(), live._interval)  # which leaves the mesh alone
        baking.cancel()
        self.assertEqual(self.state(), before)
        stage.settle(self.tube)
        self.assertLess(np.abs(stage.shown(self.tube) - shape).max(), CLOSE)

    def test_a_server_that_goes_away_is_said_and_changes_nothing(self):
        before = self.state()
        step = bake.Baking.step

        def step_and_kill(baking):
            is_finished = step(baking)
            if baking.done == 2:
                self.server.end(signal.SIGKILL)
                bake.Baking.step = step
            return is_finished

        bake.Baking.step = step_and_kill
        try:
            with self.assertRaisesRegex(RuntimeError, "The server went away at frame 5. Nothing was baked."):
                bpy.ops.lpdeform.bake()
        finally:
            bake.Baking.step = step
            self.server.start()
        self.assertEqual(self.state(), before)
        stage.settle(self.tube)  # it goes on
        self.assertEqual(bpy.ops.lpdeform.bake(), {"FINISHED"})

    def test_baking_again_replaces_the_first_and_leaves_other_animation(self):
        stage.activate(self.tube)
        live.stop(self.tube)
        self.tube.shape_key_add(name="Basis", from_mix=False)
        other = self.tube.shape_key_add(name="other", from_mix=False)
        for frame, value in ((1, 0.0), (9, 1.0)):
            other.value = value
            other.keyframe_insert("value", frame=frame)
        for _ in range(2):
            self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
            self.assertEqual(bpy.ops.lpdeform.bake(first=4, last=6, step=2), {"FINISHED"})
            keys = self.tube.data.shape_keys
            self.assertEqual(keys.key_blocks.keys(), ["Basis", "other", "lpdeform frame 4", "lpdeform frame 6"])
            paths = sorted(one.data_path for one in bake._all_curves(keys))
            self.assertEqual(paths, [f'key_blocks["{name}"].value' for name in ("lpdeform frame 4", "lpdeform frame 6", "other")])
        self.scene.frame_set(5)
        self.assertAlmostEqual(keys.key_blocks["other"].value, 0.5, delta=0.01)
        self.assertAlmostEqual(keys.key_blocks["lpdeform frame 4"].value, 0.5, delta=1e-5)

    def test_a_baked_mesh_goes_live_again_from_its_basis_and_back(self):
        self.assertEqual(bpy.ops.lpdeform.bake(), {"FINISHED"})
        baked = self.shown(6)
        self.scene.frame_set(FRAMES[0])
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        stage.settle(self.tube)
        self.assertLess(np.abs(stage.shown(self.tube) - self.rest).max(), CLOSE)
        self.assertEqual(bpy.ops.lpdeform.stop(), {"FINISHED"})
        self.assertTrue(np.array_equal(self.shown(6), baked))

    def test_a_range_without_frames_or_with_too_many_is_named(self):
        before = self.state()
        with self.assertRaisesRegex(RuntimeError, "The range has 0 frames; it takes from 1 to 10000. Nothing was baked."):
            bpy.ops.lpdeform.bake(first=7, last=3)
        with self.assertRaisesRegex(RuntimeError, "The range has 20000 frames"):
            bpy.ops.lpdeform.bake(first=1, last=20000)
        self.assertEqual(self.state(), before)

    def test_what_the_server_refuses_is_said_and_changes_nothing(self):
        before = self.state()
        self.tip.location = (1e12, 0, 0)
        self.tip.keyframe_insert("location", frame=FRAMES[2])
        with self.assertRaisesRegex(RuntimeError, "HANDLE_TARGET_TOO_FAR.* Nothing was baked."):
            bpy.ops.lpdeform.bake()
        self.assertEqual(self.state(), before)


stage.main()
