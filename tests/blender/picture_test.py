"""Three tubes live at once, the same handles at p = 1, 2 and 6, rendered by Cycles with their distortion as colours."""

import os
import sys
import unittest

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(__file__))
import stage  # noqa: E402

PREFERENCES = stage.install()
from lpdeform_addon import live, surface  # noqa: E402

SIZE = (800, 400)


def bend(ob):
    """The upper end by 90 degrees to the side, about a point beside the middle."""
    rest = stage.at_rest(ob)
    stage.add_handle(ob, np.flatnonzero(rest[:, 2] < 0.35))
    tip = stage.add_handle(ob, np.flatnonzero(rest[:, 2] > 3.65))
    assert bpy.ops.lpdeform.start() == {"FINISHED"}
    around = ob.matrix_world @ Matrix.Translation((1.1, 0, 2.0))
    tip.matrix_world = around @ Matrix.Rotation(np.pi / 2, 4, "Y") @ around.inverted() @ tip.matrix_world


def material():
    made = bpy.data.materials.new("distortion")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = surface.COLOUR_ATTRIBUTE
    links.new(colour.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.6
    return made


def light_and_camera():
    scene = bpy.context.scene
    for name, energy, at, size in (("key", 500, (-4, -6, 8), 3), ("fill", 120, (8, -5, 3), 5)):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, "AREA"))
        lamp.data.energy, lamp.data.size, lamp.location = energy, size, at
        lamp.rotation_euler = (Vector((2.6, 0, 1.5)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(lamp)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens, camera.location = 50, (4.1, -15.2, 3.9)
    camera.rotation_euler = (Vector((4.1, 0, 1.7)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, 0))
    floor = bpy.data.materials.new("floor")
    floor.diffuse_color = (0.8, 0.8, 0.8, 1)
    bpy.context.object.data.materials.append(floor)
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.35, 0.38, 0.45)


def render(path):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 24, False
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.image_settings.color_mode, scene.render.image_settings.compression = "RGB", 100
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


class Picture(unittest.TestCase):
    def test_the_meshes_are_rendered_as_they_are_deformed(self):
        server = stage.RunningServer()
        self.addCleanup(server.end)
        stage.clear()
        PREFERENCES.address = server.address
        tubes = [stage.tube(f"p = {p}", at=(2.9 * k, 0, 0)) for k, p in enumerate((1, 2, 6))]
        coloured = material()
        for ob, p in zip(tubes, (1.0, 2.0, 6.0)):
            ob.lpdeform.p = p
            ob.data.materials.append(coloured)
            ob.data.polygons.foreach_set("use_smooth", np.arange(len(ob.data.polygons)) < len(ob.data.polygons) - 2)
            bend(ob)
        stage.settle(*tubes)
        most = [float(live.of(ob).frame.distortion.max()) for ob in tubes]
        self.assertGreater(most[0], most[1])  # the larger p, the lower the peak
        self.assertGreater(most[1], most[2])
        for ob in tubes:
            ob.lpdeform.distortion_limit = most[1]
            live.of(ob).show(ob)
        light_and_camera()
        path = os.path.join(stage.PICTURES, "bent.png")
        if os.path.exists(path):
            os.remove(path)
        render(path)
        picture = bpy.data.images.load(path)
        pixels = np.empty(4 * SIZE[0] * SIZE[1], np.float32)
        picture.pixels.foreach_get(pixels)
        red, _, blue, _ = pixels.reshape(-1, 4).T
        self.assertGreater(np.mean(red > 2 * blue), 0.002)  # there are folds
        self.assertGreater(np.mean(blue > 2 * red), 0.02)  # and places that keep their shape


stage.main()
