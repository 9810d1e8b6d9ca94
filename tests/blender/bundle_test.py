"""The add-on packed with grpcio and protobuf: Blender finds them in the add-on, and they work."""

import os
import sys
import unittest

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install(with_its_own_modules_first=True)  # this Blender's Python has a grpc, which would go before


class Bundle(unittest.TestCase):
    def test_a_mesh_follows_its_handle(self):
        import grpc
        import lpdeform

        for module in (grpc, lpdeform):
            self.assertIn("lpdeform_addon/modules", module.__file__)
        server = stage.RunningServer()
        self.addCleanup(server.end)
        stage.clear()
        PREFERENCES.address = server.address
        tube = stage.tube()
        rest = stage.at_rest(tube)
        top = np.flatnonzero(rest[:, 2] > 3.7)
        stage.add_handle(tube, np.flatnonzero(rest[:, 2] < 0.3))
        tip = stage.add_handle(tube, top)
        self.assertEqual(bpy.ops.lpdeform.start(), {"FINISHED"})
        tip.matrix_world = Matrix.Translation((1, 0, 0)) @ tip.matrix_world
        stage.settle(tube)
        self.assertTrue(np.allclose(stage.shown(tube)[top], rest[top] + [1, 0, 0], atol=1e-5))


stage.main()
