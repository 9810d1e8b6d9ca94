"""A tube that is split around its middle, like meshes of game engines along seams."""

import os
import sys
import unittest
from types import SimpleNamespace
from unittest import mock

import bpy  # first: the module bpy brings the others
import bmesh
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import live, panel  # noqa: E402


def split_around(ob, height):
    """Along the ring of edges there: each of its vertices has a copy then."""
    edited = bmesh.new()
    edited.from_mesh(ob.data)
    around = [edge for edge in edited.edges if all(abs(one.co.z - height) < 1e-4 for one in edge.verts)]
    bmesh.ops.split_edges(edited, edges=around)
    edited.to_mesh(ob.data)
    edited.free()


def said_in_panel(ob):
    """The labels of the main panel, drawn for this mesh."""
    layout = mock.MagicMock()
    layout.column.return_value = layout
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))  # 0 where there is no window
    context = SimpleNamespace(object=ob, region=SimpleNamespace(width=300), preferences=preferences)
    panel.MainPanel.draw(SimpleNamespace(layout=layout), context)
    return " ".join(call.kwargs["text"] for call in layout.label.call_args_list)


class Seams(unittest.TestCase):
    def setUp(self):
        self.server = stage.RunningServer()
        self.addCleanup(self.server.end)
        stage.clear()
        stage.preferences().address = self.server.address
        self.tube = stage.tube()
        split_around(self.tube, 2.0)
        self.rest = stage.at_rest(self.tube)
        at_seam = np.flatnonzero(np.abs(self.rest[:, 2] - 2) < 1e-4)
        self.assertEqual(len(at_seam), 48)
        far = np.linalg.norm(self.rest[at_seam, None] - self.rest[None, at_seam], axis=2) + 10 * np.eye(48)
        self.seam = np.stack([at_seam, at_seam[far.argmin(axis=1)]])  # each with its copy
        self.assertLess(far.min(axis=1).max(), 1e-6)

    def tearDown(self):
        for name in list(live._running):
            live.stop(bpy.data.objects[name])

    def bend(self):
        stage.add_handle(self.tube, np.flatnonzero(self.rest[:, 2] < 0.3))
        tip = stage.add_handle(self.tube, np.flatnonzero(self.rest[:, 2] > 3.7))
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        tip.matrix_world = Matrix.Translation((1.2, 0, -0.4)) @ tip.matrix_world
        stage.settle(self.tube)

    def gap(self):
        """Between a vertex of the seam and its copy, at most."""
        one, other = stage.shown(self.tube)[self.seam]
        return np.linalg.norm(one - other, axis=1).max()

    def test_the_panel_says_that_a_split_mesh_comes_apart(self):
        self.bend()
        self.assertGreater(self.gap(), 0.1)
        self.assertRegex(said_in_panel(self.tube), "The mesh comes apart where it is split: 48 vertices .* Weld it by position")

    def test_a_welded_mesh_holds_together_and_nothing_is_said_of_it(self):
        self.tube.lpdeform.weld = True
        self.bend()
        self.assertLess(self.gap(), 1e-6)
        self.assertNotIn("split", said_in_panel(self.tube))

    def test_the_checkbox_counts_at_once(self):
        self.bend()
        self.tube.lpdeform.weld = True
        live.tick()
        stage.settle(self.tube)
        self.assertLess(self.gap(), 1e-6)
        self.assertNotIn("split", said_in_panel(self.tube))
        self.tube.lpdeform.weld = False
        live.tick()
        stage.settle(self.tube)
        self.assertGreater(self.gap(), 0.1)
        self.assertIn("split", said_in_panel(self.tube))

    def test_paint_that_differs_across_a_weld_is_named_in_the_panel(self):
        self.tube.lpdeform.weld = True
        self.bend()
        group = self.tube.vertex_groups.new(name="half")
        group.add([int(self.seam[0, 0])], 1.0, "REPLACE")
        self.tube.lpdeform.p_group = "half"
        stage.turn(lambda: "COPIES_DIFFER" in live.message(self.tube))
        self.assertIn("COPIES_DIFFER", said_in_panel(self.tube))

    def test_what_a_newer_server_says_of_itself_is_shown_as_well(self):
        self.bend()
        live.of(self.tube).session._link._stream.server_notice = live.lpdeform.Notice("other", "News of tomorrow.")
        self.assertIn("News of tomorrow.", said_in_panel(self.tube))


stage.main()
