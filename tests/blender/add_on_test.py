"""The add-on as people use it."""

import dataclasses
import os
import signal
import sys
import tempfile
import types
import typing
import unittest
from unittest import mock

import bpy  # first: the module bpy brings the others
import bmesh
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import client, holds, live, panel, surface  # noqa: E402


class AddOn(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = stage.RunningServer()

    @classmethod
    def tearDownClass(cls):
        cls.server.end()

    def setUp(self):
        stage.clear()
        stage.preferences().address = self.server.address
        self.tube = stage.tube(at=(1, 2, 3))
        self.tube.rotation_euler = (0.3, 0, 0)
        self.rest = stage.at_rest(self.tube)
        self.bottom = np.flatnonzero(self.rest[:, 2] < 0.3)
        self.top = np.flatnonzero(self.rest[:, 2] > 3.7)
        bpy.context.view_layer.update()

    def tearDown(self):
        for name in list(live._running):
            live.stop(bpy.data.objects[name])

    def held(self):
        """Live, with a handle at each end."""
        anchor = stage.add_handle(self.tube, self.bottom)
        tip = stage.add_handle(self.tube, self.top)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        return anchor, tip

    def shift(self, empty, *by):
        """Along the mesh's own axes."""
        empty.matrix_world = self.tube.matrix_world @ Matrix.Translation(by) @ self.tube.matrix_world.inverted() @ empty.matrix_world

    def test_a_handle_is_an_empty_in_the_middle_of_what_was_selected(self):
        tip = stage.add_handle(self.tube, self.top)
        self.assertEqual((tip.type, bpy.context.mode), ("EMPTY", "OBJECT"))
        bpy.context.view_layer.update()
        middle = self.tube.matrix_world.inverted() @ tip.matrix_world.translation
        self.assertTrue(np.allclose(middle, self.rest[self.top].mean(axis=0), atol=1e-5))
        self.assertEqual(np.flatnonzero(surface.held(self.tube)).tolist(), self.top.tolist())

    def test_moving_the_empty_moves_the_mesh_and_leaves_the_basis(self):
        _, tip = self.held()
        self.assertTrue(bpy.app.timers.is_registered(live.tick))
        for step in range(10):
            self.shift(tip, 0.1, 0, 0)
            bpy.context.view_layer.update()
            live.tick()
        stage.settle(self.tube)
        now = stage.shown(self.tube)
        self.assertTrue(np.allclose(now[self.top], self.rest[self.top] + [1, 0, 0], atol=1e-5))
        self.assertTrue(np.allclose(now[self.bottom], self.rest[self.bottom], atol=1e-6))
        self.assertTrue(np.array_equal(stage.at_rest(self.tube), self.rest))
        middle = now[np.abs(self.rest[:, 2] - 2) < 0.05].mean(axis=0)
        self.assertTrue(0.2 < middle[0] < 0.8, middle)

    def test_a_handle_in_faces_holds_their_middles(self):
        self.held()
        sides = [face.index for face in self.tube.data.polygons if abs(face.center[2] - 2) < 0.1 and face.center[0] > 0.35]
        self.assertGreater(len(sides), 1)
        tip = stage.add_handle(self.tube, [], faces=sides)
        self.assertEqual(surface.held(self.tube).max(), 2)
        corners = [list(self.tube.data.polygons[k].vertices) for k in sides]
        middles = np.array([self.rest[one].mean(axis=0) for one in corners])
        bpy.context.view_layer.update()
        at = self.tube.matrix_world.inverted() @ tip.matrix_world.translation
        self.assertTrue(np.allclose(at, middles.mean(axis=0), atol=1e-5))
        self.shift(tip, 0.5, 0, 0.2)
        stage.settle(self.tube)
        faces, barycentric, places = surface.middles(self.tube, sides, self.rest)
        self.assertTrue(np.allclose(places, middles, atol=1e-5))
        now = stage.shown(self.tube)[surface.triangles(self.tube)[faces]]
        self.assertTrue(np.allclose(np.einsum("kc,kcx->kx", barycentric, now), middles + [0.5, 0, 0.2], atol=1e-4))
        self.assertEqual(bpy.ops.lpdeform.remove_handle(), {"FINISHED"})
        self.assertEqual(surface.held_faces(self.tube).max(), 0)
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-3))

    def test_no_face_selected_is_said(self):
        stage.select(self.tube, [])
        with self.assertRaisesRegex(RuntimeError, "Select the faces in Edit mode"):
            bpy.ops.lpdeform.add_handle(in_faces=True)

    def test_solve_waits_for_the_result_and_says_its_bound(self):
        _, tip = self.held()
        self.shift(tip, 1.2, 0, -0.6)
        bpy.context.view_layer.update()
        stage.activate(self.tube)
        self.assertEqual(bpy.ops.lpdeform.solve(), {"FINISHED"})
        running = live.of(self.tube)
        self.assertEqual(running.result.stop_reason, "converged")
        self.assertLess(running.shown.optimality_gap, 1e-3)
        solved = stage.shown(self.tube)
        self.assertTrue(np.allclose(solved[self.top], self.rest[self.top] + [1.2, 0, -0.6], atol=1e-5))
        stage.settle(self.tube)  # the frames that come after do not take its place
        self.assertTrue(np.array_equal(stage.shown(self.tube), solved))
        self.shift(tip, 0.1, 0, 0)
        stage.settle(self.tube)
        self.assertIsNone(running.result)
        with self.assertRaisesRegex(RuntimeError, "SOLVE_"):
            bpy.ops.lpdeform.solve(timeout=0)
        self.assertEqual(bpy.ops.lpdeform.apply(name="Solved"), {"FINISHED"})

    def test_the_mesh_and_its_handles_may_be_moved_together(self):
        _, tip = self.held()
        self.shift(tip, 0, 0.5, 0)
        stage.settle(self.tube)
        before = stage.shown(self.tube)
        moved = Matrix.Translation((5, 0, 0)) @ Matrix.Rotation(1.0, 4, "Z")
        for one in bpy.context.scene.objects:
            one.matrix_world = moved @ one.matrix_world
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), before, atol=1e-3))

    def test_a_scaled_empty_scales_what_it_holds(self):
        _, tip = self.held()
        tip.scale = (2, 2, 2)
        bpy.context.view_layer.update()
        stage.settle(self.tube)
        now, middle = stage.shown(self.tube)[self.top], self.rest[self.top].mean(axis=0)
        self.assertTrue(np.allclose(now - middle, 2 * (self.rest[self.top] - middle), atol=1e-5))

    def test_p_is_a_property_and_a_weight_painted_group(self):
        _, tip = self.held()
        self.shift(tip, 1.2, 0, -0.6)
        stage.settle(self.tube)
        even = stage.shown(self.tube)
        self.tube.lpdeform.p = 1.0
        stage.settle(self.tube)
        creased = stage.shown(self.tube)
        self.assertGreater(np.abs(creased - even).max(), 0.02)
        self.tube.lpdeform.p = 2.0
        group = self.tube.vertex_groups.new(name="soft")
        group.add(np.flatnonzero(self.rest[:, 2] < 2).tolist(), 1.0, "REPLACE")
        self.tube.lpdeform.p_group, self.tube.lpdeform.p_painted = "soft", 1.0
        stage.settle(self.tube)
        sent = live.of(self.tube).fields["p"]
        self.assertEqual(sorted(set(sent.tolist())), [1.0, 2.0])
        painted = stage.shown(self.tube)
        self.assertGreater(np.abs(painted - even).max(), 0.01)
        stage.activate(self.tube)
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
        self.change_weights(gain=0.0)
        stage.turn(lambda: not live.of(self.tube)._weights["p"].any())
        stage.settle(self.tube)
        self.assertEqual(set(live.of(self.tube).fields["p"].tolist()), {2.0})
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_weights_are_read_once_after_a_stroke_and_not_while_nothing_is_painted(self):
        _, tip = self.held()
        group = self.tube.vertex_groups.new(name="soft")
        self.tube.lpdeform.p_group, self.tube.lpdeform.p_painted = "soft", 1.0
        stage.settle(self.tube)
        stage.activate(self.tube)
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
        stage.settle(self.tube)
        with mock.patch.object(live.surface, "group_weights", wraps=live.surface.group_weights) as reads:

            def reads_in(ticks):
                """Of this group."""
                before = [call.args[1] for call in reads.call_args_list].count("soft")
                for _ in range(ticks):
                    bpy.context.view_layer.update()
                    live.tick()
                return [call.args[1] for call in reads.call_args_list].count("soft") - before

            self.assertEqual(reads_in(300), 0)
            for _ in range(30):  # dabs of a stroke
                group.add([0], 0.5, "ADD")
                self.tube.data.update_tag()
                self.assertEqual(reads_in(10), 0)
            self.change_weights(gain=0.5)  # as the end of a stroke, an operator that makes a step for undo
            self.assertEqual(reads_in(300), 1)
            self.assertEqual(live.of(self.tube)._weights["p"][0], 0.5)
            live.of(self.tube).show(self.tube)  # a frame changes the mesh, and no weight
            self.assertEqual(reads_in(300), 0)
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_weights_that_an_operator_changes_in_object_mode_are_read(self):
        self.held()
        group = self.tube.vertex_groups.new(name="soft")
        group.add(np.arange(len(self.rest)).tolist(), 1.0, "REPLACE")
        self.tube.lpdeform.p_group, self.tube.lpdeform.p_painted = "soft", 1.0
        stage.settle(self.tube)
        stage.activate(self.tube)
        self.change_weights(gain=0.25)
        stage.turn(lambda: np.allclose(live.of(self.tube)._weights["p"], 0.25))

    def change_weights(self, gain):
        """By an operator that a person starts: such operators make a step for undo."""
        bpy.context.view_layer.objects.active = self.tube
        self.assertEqual(bpy.ops.object.vertex_group_levels("EXEC_DEFAULT", True, gain=gain), {"FINISHED"})

    def test_stiffness_is_a_property_and_a_group(self):
        _, tip = self.held()
        self.shift(tip, 1.2, 0, -0.6)
        stage.settle(self.tube)
        before = stage.shown(self.tube)
        group = self.tube.vertex_groups.new(name="hard")
        group.add(np.flatnonzero(self.rest[:, 2] < 2).tolist(), 0.5, "REPLACE")
        self.tube.lpdeform.stiffness_group, self.tube.lpdeform.stiffness_painted = "hard", 10000.0
        stage.settle(self.tube)
        sent = live.of(self.tube).fields["stiffness"]
        self.assertTrue(np.allclose(np.unique(sent), [1, 100]), np.unique(sent))  # half way by powers
        lower = np.flatnonzero((self.rest[:, 2] > 1) & (self.rest[:, 2] < 1.1))
        lean_before, lean = before[lower, 0].mean(), stage.shown(self.tube)[lower, 0].mean()
        self.assertLess(abs(lean), 0.5 * abs(lean_before))  # the stiff half stays straight

    def test_resizing_stretches_along_the_meshs_axes_and_ends_where_it_began(self):
        stage.activate(self.tube)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        stage.settle(self.tube)
        self.tube.lpdeform.resize = (1.0, 1.0, 2.0)
        stage.settle(self.tube)
        extent = np.ptp(stage.shown(self.tube), axis=0)
        self.assertTrue(np.allclose(extent, [0.8, 0.8, 8.0], atol=0.02), extent)
        self.assertEqual(live.message(self.tube), "")
        self.tube.lpdeform.p = 3.0  # counts when the resizing ends
        self.tube.lpdeform.resize = (1.0, 1.0, 1.5)
        stage.settle(self.tube)
        self.assertAlmostEqual(float(np.ptp(stage.shown(self.tube)[:, 2])), 6.0, delta=0.02)
        self.tube.lpdeform.resize = (1.0, 1.0, 1.0)
        tip = stage.add_handle(self.tube, self.top)
        stage.add_handle(self.tube, self.bottom)
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-2))
        told = live.of(self.tube)._told
        self.assertEqual(set(np.frombuffer(told.last("p").value)), {3.0})
        self.assertIsNone(told.last("resize"))
        self.tube.lpdeform.resize = (1.0, 1.0, 2.0)  # which holds the ends that handles hold
        bpy.context.view_layer.update()
        stage.turn(lambda: "HANDLE_VERTEX" in live.message(self.tube))
        self.tube.lpdeform.resize = (1.0, 1.0, 1.0)
        self.shift(tip, 0.5, 0, 0)
        stage.settle(self.tube)
        stage.turn(lambda: live.message(self.tube) == "")
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))

    def test_blenders_undo_takes_back_what_a_person_did_and_the_mesh_follows(self):
        def step(name):
            bpy.context.view_layer.update()
            self.assertEqual(bpy.ops.ed.undo_push(message=name), {"FINISHED"})

        def back(how=bpy.ops.ed.undo):
            self.assertEqual(how(), {"FINISHED"})
            self.tube = bpy.data.objects["tube"]  # undo exchanges Blender's data
            return bpy.data.objects["tube handle.001"]

        _, tip = self.held()
        stage.settle(self.tube)
        step("Go live")
        self.shift(tip, 0.5, 0, 0)
        step("Move")  # before its frame is there
        stage.settle(self.tube)
        stage.activate(self.tube)
        step("Select")
        stage.activate(bpy.data.objects["tube handle.001"])
        step("Select again")
        back()
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))
        tip = back()
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))
        tip = back()  # of the move
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-3))
        tip = back(bpy.ops.ed.redo)
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))
        stage.activate(tip)
        self.assertEqual(bpy.ops.lpdeform.remove_handle(), {"FINISHED"})
        step("Remove handle")
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-3))
        back()
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))

    def test_an_overloaded_server_is_said_in_the_panel(self):
        self.held()
        stage.settle(self.tube)
        running = live.of(self.tube)
        self.assertEqual(running.notice, "")
        stream = running.session._link._stream
        stream.server_notice = client.lpdeform.Notice("overloaded", "Too much.")
        self.assertEqual(running.notice, "Too much.")
        stream.server_notice = client.lpdeform.Notice("recovered", "No more.")
        self.assertEqual(running.notice, "")
        self.assertFalse(bpy.ops.lpdeform.take_better.poll())

    def test_a_better_shape_is_offered_until_something_newer_is_sent(self):
        _, tip = self.held()
        stage.settle(self.tube)
        running = live.of(self.tube)
        self.assertFalse(bpy.ops.lpdeform.take_better.poll())
        stream = running.session._link._stream
        newest = running.session.newest_input
        stream.better = client.lpdeform.Notice("better_shape", "A better one.", newest, 1.0, 0.07)
        self.assertEqual(running.notice, "A better one.")
        self.assertTrue(bpy.ops.lpdeform.take_better.poll())
        self.shift(tip, 0.1, 0, 0)
        running._tell(self.tube)  # no frame has come for it yet
        self.assertGreater(running.session.newest_input, newest)
        stream.better = client.lpdeform.Notice("better_shape", "A better one.", newest, 1.0, 0.07)
        self.assertEqual(running.notice, "")
        stage.activate(self.tube)
        self.assertFalse(bpy.ops.lpdeform.take_better.poll())

    def test_the_certificate_is_said_of_the_rotations_and_below_it_what_is_known_of_other_minima(self):
        self.held()
        stage.settle(self.tube)
        running = live.of(self.tube)
        self.assertEqual(running.proof, [])
        running.frame = types.SimpleNamespace(optimality_gap=0.002, input_seq=running.frame.input_seq)
        rotations = "Optimal to 0.2 % for its rotations"
        self.assertEqual(running.proof, [rotations, "Another minimum may be lower"])
        better = client.lpdeform.Notice("better_shape", "A better one.", running.session.newest_input, 1.0, 0.07)
        running.session._link._stream.better = better
        self.assertEqual((running.proof, running.notice), ([rotations], "A better one."))
        self.assertEqual(bpy.ops.lpdeform.solve(), {"FINISHED"})
        said, searched = running.proof
        self.assertRegex(said, r"^Optimal to \S+ % for its rotations$")
        self.assertEqual(searched.lower(), running.result.searched)
        self.assertEqual(running.notice, "")  # the server has forgotten that shape
        running.result = dataclasses.replace(running.result, optimality_gap=1.0)
        self.assertEqual(running.proof[0], "No bound was found")

    def test_what_is_said_in_the_panel_is_not_cut(self):
        said = "The target of vertex 1440 of handle 2 is over 1e9 diagonals of the mesh away. (HANDLE_TARGET_TOO_FAR)"
        for width in (100, 230, 1000):
            found = panel.lines(said, width)
            self.assertEqual(" ".join(found).replace(" ", ""), said.replace(" ", ""))
            self.assertLessEqual(max(map(len, found)), max(12, width / 7.5))
        self.assertEqual(panel.lines(said, 1000), [said])

    def test_there_is_a_kind_for_each_hold_of_the_package(self):
        made = [type(kind.make(1.0, (0.0, 0.0, 1.0))) for kind in holds.KINDS.values()]
        self.assertEqual(made, list(typing.get_args(client.lpdeform.types.Hold)))

    def test_kinds_of_handles_hold_as_they_say(self):
        _, tip = self.held()
        tip.lpdeform_handle.kind = "PLANE"
        self.shift(tip, 1, 0, 0.5)
        stage.settle(self.tube)
        now = stage.shown(self.tube)[self.top]
        self.assertTrue(np.allclose(now[:, 2], self.rest[self.top][:, 2] + 0.5, atol=1e-4))
        self.assertLess(np.abs(now[:, 0].mean()), 0.5)  # free across
        tip.lpdeform_handle.kind, tip.lpdeform_handle.weight = "SOFT", 1e-6
        stage.settle(self.tube)
        self.assertLess(np.abs(stage.shown(self.tube) - self.rest).max(), 0.05)

    def test_distortion_is_a_colour_attribute(self):
        _, tip = self.held()
        self.shift(tip, 1.5, 0, -0.5)
        stage.settle(self.tube)
        attribute = self.tube.data.color_attributes[surface.COLOUR_ATTRIBUTE]
        colours = np.empty(4 * len(self.rest), np.float32)
        attribute.data.foreach_get("color", colours)
        colours = colours.reshape(-1, 4)
        distortion = live.of(self.tube).frame.distortion
        worst, best = distortion.argmax(), distortion.argmin()
        self.assertTrue(np.allclose(colours[worst], [0.75, 0.02, 0.02, 1], atol=1e-5))
        self.assertGreater(colours[best, 2], colours[best, 0])
        self.assertEqual((attribute.domain, attribute.data_type), ("POINT", "FLOAT_COLOR"))

    def test_a_pose_is_applied_as_a_shape_key(self):
        _, tip = self.held()
        self.shift(tip, 1, 0, 0)
        stage.settle(self.tube)
        posed = stage.shown(self.tube)
        self.assertEqual(bpy.ops.lpdeform.apply(name="Lean"), {"FINISHED"})
        self.assertIsNone(live.of(self.tube))
        keys = self.tube.data.shape_keys.key_blocks
        self.assertEqual(keys.keys(), ["Basis", "Lean"])
        self.assertTrue(np.allclose(stage.shown(self.tube), posed, atol=1e-6))
        keys["Lean"].value = 0
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-6))
        keys["Lean"].value = 1
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})  # again, from the basis and not from the sum
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [1, 0, 0], atol=1e-5))
        self.assertEqual(bpy.ops.lpdeform.stop(), {"FINISHED"})
        self.assertTrue(np.allclose(stage.shown(self.tube), posed, atol=1e-6))

    def test_stopping_leaves_the_mesh_as_it_was(self):
        _, tip = self.held()
        self.shift(tip, 1, 0, 0)
        stage.settle(self.tube)
        stage.activate(self.tube)
        self.assertEqual(bpy.ops.lpdeform.stop(), {"FINISHED"})
        self.assertIsNone(self.tube.data.shape_keys)
        self.assertTrue(np.array_equal(stage.shown(self.tube), self.rest))

    def test_handles_come_and_go_while_it_is_live(self):
        _, tip = self.held()
        self.shift(tip, 0, 0, 0.5)
        stage.settle(self.tube)
        middle = np.flatnonzero(np.abs(self.rest[:, 2] - 2) < 0.05)
        waist = stage.add_handle(self.tube, middle)
        self.shift(waist, 0, 0.7, 0)
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[middle], self.rest[middle] + [0, 0.7, 0], atol=1e-5))
        self.assertEqual(bpy.ops.lpdeform.put_back(), {"FINISHED"})
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[middle], self.rest[middle], atol=1e-5))
        self.assertEqual(bpy.ops.lpdeform.remove_handle(), {"FINISHED"})
        stage.settle(self.tube)
        self.assertGreater(stage.shown(self.tube)[middle, 2].mean(), 2.1)  # stretched with the rest again
        bpy.data.objects.remove(tip)  # as with X
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube), self.rest, atol=1e-3))

    def test_a_vertex_goes_to_the_handle_that_was_added_last(self):
        stage.add_handle(self.tube, self.top)
        stage.add_handle(self.tube, self.top[:10])
        numbers = surface.held(self.tube)
        self.assertEqual(set(numbers[self.top[:10]]), {2})
        self.assertEqual(set(numbers[self.top[10:]]), {1})

    def test_a_mesh_changed_in_edit_mode_is_sent_again(self):
        _, tip = self.held()
        self.shift(tip, 0.5, 0, 0)
        stage.settle(self.tube)
        stage.select(self.tube, np.flatnonzero(np.abs(self.rest[:, 2] - 2) < 0.05))
        live.tick()  # nothing is written while it is edited
        bpy.ops.mesh.subdivide()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertGreater(len(self.tube.data.vertices), len(self.rest))
        stage.settle(self.tube)
        self.assertEqual(live.of(self.tube).frame.positions.shape[0], len(self.tube.data.vertices))
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))

    def test_a_mesh_changed_by_a_script_is_sent_again(self):
        _, tip = self.held()
        self.shift(tip, 0.5, 0, 0)
        stage.settle(self.tube)
        edited = bmesh.new()
        edited.from_mesh(self.tube.data)
        bmesh.ops.subdivide_edges(edited, edges=edited.edges[:40], cuts=1)
        edited.to_mesh(self.tube.data)
        edited.free()
        stage.turn(lambda: len(live.of(self.tube)._rest) == len(self.tube.data.vertices))
        stage.settle(self.tube)
        self.assertGreater(len(self.tube.data.vertices), len(self.rest))
        self.assertEqual(live.message(self.tube), "")

    def test_what_is_refused_is_said_and_takes_nothing_else_with_it(self):
        _, tip = self.held()
        self.shift(tip, 0.5, 0, 0)
        stage.settle(self.tube)
        even = stage.shown(self.tube)
        home = tip.matrix_world.copy()
        self.tube.lpdeform.p = 1.0  # in one update with what the server refuses
        self.shift(tip, 1e12, 0, 0)
        bpy.context.view_layer.update()
        stage.turn(lambda: "HANDLE_TARGET_TOO_FAR" in live.message(self.tube))
        stage.turn(lambda: live.of(self.tube)._told.last("p") is not None and not live.of(self.tube)._told._unanswered)
        refused = live.of(self.tube)._told._refused
        self.assertEqual(list(refused), ["handle 2"])
        live.tick()
        self.assertEqual(live.of(self.tube)._told._unanswered, {})  # not again and again
        tip.matrix_world = home
        stage.settle(self.tube)
        now = stage.shown(self.tube)
        self.assertTrue(np.allclose(now[self.top], even[self.top], atol=1e-5))
        self.assertGreater(np.abs(now - even).max(), 0.005)  # p = 1 counts
        stage.turn(lambda: live.message(self.tube) == "")

    def test_how_far_to_look_for_lower_minima_is_told_when_it_changes(self):
        self.held()
        stage.settle(self.tube)
        running = live.of(self.tube)
        self.assertEqual(running._told.last("solver").value, (None, False, 0.02))
        before = running.session.newest_input
        self.tube.lpdeform.search_effort = 0
        self.tube.lpdeform.search_percent = 50
        self.tube.lpdeform.search_shows = True
        stage.settle(self.tube)
        self.assertEqual(running.session.newest_input, before + 1)
        self.assertEqual(running._told.last("solver").value, (0, True, 0.5))
        self.assertEqual(bpy.ops.lpdeform.solve(), {"FINISHED"})
        self.assertEqual(running.result.effort, 0)

    def test_a_better_shape_takes_the_place_of_a_solved_one_and_other_frames_for_its_input_do_not(self):
        self.held()
        stage.settle(self.tube)
        running = live.of(self.tube)
        self.assertEqual(bpy.ops.lpdeform.solve(), {"FINISHED"})
        solved = running.result

        def take(energy: float):
            shown = dict(positions=solved.positions, distortion=solved.distortion, optimality_gap=None)
            frame = types.SimpleNamespace(input_seq=solved.input_seq, energy=energy, **shown)
            running._take(self.tube, lambda: frame)
            return frame

        take(solved.energy)
        self.assertIs(running.shown, solved)
        better = take(0.9 * solved.energy)
        self.assertIs(running.shown, better)

    def test_p_by_shape_a_region_and_a_bound(self):
        self.tube.lpdeform.certify = True
        _, tip = self.held()
        self.shift(tip, 1.2, 0, -0.6)
        stage.settle(self.tube)
        stage.turn(lambda: live.of(self.tube).frame.optimality_gap is not None)
        self.assertLess(live.of(self.tube).frame.optimality_gap, 0.01)
        before = stage.shown(self.tube)
        group = self.tube.vertex_groups.new(name="upper")
        upper = self.rest[:, 2] > 2
        group.add(np.flatnonzero(upper).tolist(), 1.0, "REPLACE")
        self.tube.lpdeform.region_group = "upper"
        self.shift(tip, 0.5, 0, 0)
        stage.settle(self.tube)
        now = stage.shown(self.tube)
        self.assertTrue(np.allclose(now[~upper], before[~upper], atol=1e-5))
        self.tube.lpdeform.region_group = ""
        stage.settle(self.tube)
        freed = stage.shown(self.tube)
        self.assertGreater(np.abs(freed - now)[~upper].max(), 0.01)
        self.tube.lpdeform.p = 1.0
        stage.settle(self.tube)
        self.assertGreater(np.abs(stage.shown(self.tube) - freed).max(), 0.005)
        self.tube.lpdeform.p_automatic = 1.0  # a tube has no joints: p = 2 everywhere, as before
        stage.settle(self.tube)
        self.assertLess(np.abs(stage.shown(self.tube) - freed).max(), 1e-3)

    def test_files_of_the_preferences_that_cannot_be_used_are_named(self):
        stage.add_handle(self.tube, self.top)
        try:
            PREFERENCES.use_tls, PREFERENCES.root_certificates = True, "/nowhere/ca.pem"
            with self.assertRaisesRegex(RuntimeError, "/nowhere/ca.pem"):
                bpy.ops.lpdeform.start()
            PREFERENCES.root_certificates = __file__
            with self.assertRaisesRegex(RuntimeError, "TLS_CERTIFICATES"):
                bpy.ops.lpdeform.start()
            PREFERENCES.use_tls, PREFERENCES.token_file = False, "/nowhere/token"
            with self.assertRaisesRegex(RuntimeError, "/nowhere/token"):
                bpy.ops.lpdeform.start()
        finally:
            PREFERENCES.use_tls, PREFERENCES.root_certificates, PREFERENCES.token_file = False, "", ""
        self.assertIsNone(self.tube.data.shape_keys)

    def test_a_token_file_that_goes_away_ends_the_edited_mesh_with_a_message_and_no_other(self):
        other = stage.tube(name="other", at=(5, 0, 0))
        rest = stage.at_rest(other)
        tip = stage.add_handle(other, np.flatnonzero(rest[:, 2] > 3.7))
        stage.activate(other)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        stage.activate(self.tube)
        self.held()
        stage.settle(self.tube)
        try:
            PREFERENCES.token_file = "/nowhere/token"
            stage.select(self.tube, np.flatnonzero(np.abs(self.rest[:, 2] - 2) < 0.05))
            live.tick()
            bpy.ops.mesh.subdivide()
            bpy.ops.object.mode_set(mode="OBJECT")
            self.assertIsNotNone(live.tick())
        finally:
            PREFERENCES.token_file = ""
        self.assertIsNone(live.of(self.tube))
        self.assertRegex(live.message(self.tube), "^Ended: .*/nowhere/token")
        tip.location.x += 0.5
        stage.settle(other)
        self.assertGreater(np.abs(stage.shown(other) - rest).max(), 0.4)

    def test_a_mesh_edited_into_one_that_cannot_be_deformed_ends_with_a_message(self):
        self.held()
        stage.settle(self.tube)
        session = live.of(self.tube).session
        stage.select(self.tube, np.arange(len(self.rest)))
        live.tick()
        bpy.ops.mesh.delete(type="ONLY_FACE")
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertIsNone(live.tick())
        self.assertEqual(live._running, {})
        self.assertRegex(live.message(self.tube), "^Ended: The mesh cannot be deformed")
        self.assertEqual(session.connection, "closed")

    def test_a_token_is_read_without_blender(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("secret\n")
            file.flush()
            PREFERENCES.token_file = file.name
            abspath = bpy.path.abspath
            try:
                token = client.access()["token"]
                bpy.path.abspath = None
                self.assertEqual(token(), "secret")
            finally:
                bpy.path.abspath, PREFERENCES.token_file = abspath, ""

    def test_a_server_that_asks_for_a_token_over_tls_lets_in_by_the_preferences(self):
        with tempfile.TemporaryDirectory() as folder:
            cert, key, signer, public, token = (os.path.join(folder, name) for name in ("cert", "key", "signer", "public", "token"))
            stage.openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=server", "-addext",
                          "subjectAltName=IP:127.0.0.1", "-days", "2", "-keyout", key, "-out", cert)
            stage.openssl("genrsa", "-out", signer, "2048")
            stage.openssl("rsa", "-in", signer, "-pubout", "-out", public)
            with open(token, "w") as file:
                file.write(stage.token_of("an artist", signer) + "\n")
            server = stage.RunningServer("--tls-cert", cert, "--tls-key", key, "--token-keys", public)
            self.addCleanup(server.end)
            preferences = stage.preferences()
            preferences.address, preferences.use_tls, preferences.root_certificates = server.address, True, cert
            try:
                stage.activate(self.tube)
                with self.assertRaisesRegex(RuntimeError, "The server does not let us in.*TOKEN_MISSING"):
                    bpy.ops.lpdeform.start()
                preferences.token_file = token
                _, tip = self.held()
                self.shift(tip, 0.5, 0, 0)
                stage.settle(self.tube)
            finally:
                preferences.use_tls, preferences.root_certificates, preferences.token_file = False, "", ""
            self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.5, 0, 0], atol=1e-5))
            live.stop(self.tube)

    def test_no_server_is_said_clearly_and_changes_nothing(self):
        stage.add_handle(self.tube, self.top)
        PREFERENCES.address = "127.0.0.1:1"
        with self.assertRaisesRegex(RuntimeError, r"No lpdeform server answers at 127\.0\.0\.1:1\. Start one with deploy/up"):
            bpy.ops.lpdeform.start()
        self.assertIsNone(self.tube.data.shape_keys)
        self.assertIsNone(live.of(self.tube))

    def test_a_blender_without_grpcio_is_said_and_changes_nothing(self):
        stage.add_handle(self.tube, self.top)
        stage.activate(self.tube)
        with mock.patch.dict(sys.modules, {"grpc": None}), \
                self.assertRaisesRegex(RuntimeError, "grpcio and protobuf cannot be used.*install python3-grpcio"):
            bpy.ops.lpdeform.start()
        self.assertIsNone(self.tube.data.shape_keys)

    def test_a_server_that_comes_back_is_gone_on_with(self):
        _, tip = self.held()
        self.shift(tip, 0.3, 0, 0)
        stage.settle(self.tube)
        self.server.end(signal.SIGKILL)
        stage.turn(lambda: live.of(self.tube).state == "reconnecting")
        self.shift(tip, 0.3, 0, 0)
        bpy.context.view_layer.update()
        live.tick()
        self.server.start()
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.6, 0, 0], atol=1e-5))

    def test_what_the_server_refuses_is_shown_and_the_mesh_goes_on(self):
        _, tip = self.held()
        stage.settle(self.tube)
        live.of(self.tube).session.set_handle("wrong", [10**6])
        stage.turn(lambda: "HANDLE_VERTEX_OUT_OF_RANGE" in live.message(self.tube))
        self.shift(tip, 0.3, 0, 0)
        stage.settle(self.tube)
        stage.turn(lambda: live.message(self.tube) == "")

    def test_another_machine_needs_leave_to_go_online(self):
        stage.add_handle(self.tube, self.top)
        PREFERENCES.address = "server.example:50051"
        stage.activate(self.tube)
        with mock.patch.object(client.bpy, "app", types.SimpleNamespace(online_access=False)), \
                self.assertRaisesRegex(RuntimeError, "Blender may not go online, and server.example:50051 is another machine"):
            bpy.ops.lpdeform.start()
        self.assertIsNone(self.tube.data.shape_keys)

    def test_an_extension_brings_its_packages_and_an_older_add_on_that_of_lpdeform(self):
        import google.protobuf
        import grpc

        if stage.IS_EXTENSION:
            for module in (grpc, google.protobuf, client.lpdeform):
                self.assertIn("/extensions/.local/lib/", module.__file__)
        else:
            self.assertRegex(client.lpdeform.__file__, r"/lpdeform_addon/wheels/lpdeform-[0-9.]+-py3-none-any\.whl/")

    def test_meshes_that_cannot_be_deformed_are_named(self):
        flat = bpy.data.meshes.new("flat")
        flat.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
        ob = bpy.data.objects.new("flat", flat)
        bpy.context.scene.collection.objects.link(ob)
        stage.activate(ob)
        with self.assertRaisesRegex(RuntimeError, "The mesh cannot be deformed: .*MESH_NO_AREA"):
            bpy.ops.lpdeform.start()
        self.assertIsNone(flat.shape_keys)

    def test_nothing_selected_is_said(self):
        stage.select(self.tube, [])
        with self.assertRaisesRegex(RuntimeError, "Select the vertices in Edit mode"):
            bpy.ops.lpdeform.add_handle()

    def test_a_file_that_is_saved_and_opened_again_goes_on(self):
        _, tip = self.held()
        self.shift(tip, 0.4, 0, 0)
        stage.settle(self.tube)
        path = os.path.join(bpy.app.tempdir, "saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(live._running, {})
        self.tube = bpy.data.objects["tube"]
        stage.activate(self.tube)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        stage.settle(self.tube)
        self.assertTrue(np.allclose(stage.shown(self.tube)[self.top], self.rest[self.top] + [0.4, 0, 0], atol=1e-5))

    def test_what_is_deleted_while_live_ends_quietly(self):
        self.held()
        stage.settle(self.tube)
        bpy.data.objects.remove(self.tube)
        self.assertIsNone(live.tick())
        self.assertEqual(live._running, {})


stage.main()
