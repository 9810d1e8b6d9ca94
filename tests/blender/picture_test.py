"""Three tubes live at the same time with the same handles at p = 1, 2 and 6, rendered by Cycles with their distortion as
colours."""

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

SIZE = (800, 384)
PLACES = 2.9  # from tube to tube
CAMERA = Vector((4.45, -16.5, 4.2))


def bend(ob):
    """The upper end by 90 degrees to the side, about a point beside the middle."""
    rest = stage.at_rest(ob)
    stage.add_handle(ob, np.flatnonzero(rest[:, 2] < 0.35))
    tip = stage.add_handle(ob, np.flatnonzero(rest[:, 2] > 3.65))
    assert bpy.ops.lpdeform.start() == {"FINISHED"}
    around = ob.matrix_world @ Matrix.Translation((1.1, 0, 2.0))
    tip.matrix_world = around @ Matrix.Rotation(np.pi / 2, 4, "Y") @ around.inverted() @ tip.matrix_world


def material(name, colour=(0.8, 0.8, 0.8), roughness=0.5, attribute="", glow=0.0):
    """Of one colour, or of a colour attribute; with a glow of 1 it is seen as it is, whatever the light."""
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    surface_of = nodes["Principled BSDF"].inputs
    surface_of["Base Color"].default_value = (*colour, 1)
    surface_of["Roughness"].default_value = roughness
    specular, emission = ("Specular IOR Level", "Emission Color") if bpy.app.version >= (4, 0, 0) else ("Specular", "Emission")
    surface_of[specular].default_value = 0.3 if glow == 0 else 0.0
    if attribute:
        source = nodes.new("ShaderNodeVertexColor")
        source.layer_name = attribute
        links.new(source.outputs["Color"], surface_of["Base Color" if glow == 0 else emission])
    if glow > 0:
        surface_of["Base Color"].default_value = (0, 0, 0, 1)
        surface_of["Emission Strength"].default_value = glow
    return made


def add_mesh(name, vertices, faces, made_of):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, one)) for one in vertices], [], faces)
    mesh.materials.append(made_of)
    ob = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def strip(name, profile, across, made_of):
    """A profile in the plane of y and z, drawn along x."""
    vertices = [(x, y, z) for y, z in profile for x in across]
    faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(profile) - 1)]
    ob = add_mesh(name, vertices, faces, made_of)
    ob.data.polygons.foreach_set("use_smooth", np.ones(len(ob.data.polygons), bool))
    return ob


def backdrop():
    """A floor that turns up into a wall without an edge."""
    bend = [(8 + 4 * np.sin(a), 4 - 4 * np.cos(a)) for a in np.linspace(0, np.pi / 2, 24)]
    paper = strip("backdrop", [(-25, 0), *bend, (12, 25)], (-40, 48), material("paper", (0.83, 0.81, 0.78), 0.9))
    paper.visible_diffuse = False  # what is lit by the even sky alone has little noise: Debian's Cycles has no denoiser


def write(text, at, size, align, made_of):
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size, curve.align_x = text, size, align
    curve.materials.append(made_of)
    ob = bpy.data.objects.new(text, curve)
    ob.location, ob.rotation_euler, ob.visible_shadow = at, (np.pi / 2, 0, 0), False
    bpy.context.scene.collection.objects.link(ob)


def legend(ink, at=(6.7, -2.2, 0.12), width=2.5, height=0.16):
    """The colours of the add-on, from none to the most of p = 2."""
    share = np.linspace(0, 1, 65)
    vertices = [(at[0] + width * s, at[1], at[2] + up) for s in share for up in (0, height)]
    bar = add_mesh("legend", vertices, [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(64)],
                   material("colours", attribute="colours", glow=1.0))
    bar.visible_shadow = False
    colours = bar.data.color_attributes.new("colours", "FLOAT_COLOR", "POINT")
    colours.data.foreach_set("color", surface.colours(np.repeat(share, 2), 1.0).reshape(-1))
    above = at[2] + height + 0.12
    write("no distortion", (at[0], at[1], above), 0.22, "LEFT", ink)
    write("most", (at[0] + width, at[1], above), 0.22, "RIGHT", ink)


def light_and_camera():
    scene = bpy.context.scene
    middle = Vector((PLACES + 1.1, 0, 1.4))
    # One lamp with soft shadows, and an even sky that is not sampled as a second one: little noise from few samples.
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.data.color, sun.location = 2.0, 0.3, (1.0, 0.95, 0.88), (-3, -7, 8)
    sun.rotation_euler = (middle - sun.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(sun)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens, camera.location = 50, CAMERA
    camera.rotation_euler = (Vector((CAMERA.x, 0, 1.4)) - CAMERA).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.34, 0.36, 0.39)
    scene.world.cycles.sampling_method = "NONE"


def render(path):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 40, False
    scene.cycles.max_bounces = 1
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
        tubes = [stage.tube(f"p = {p}", around=48, along=121, at=(PLACES * k, 0, 0)) for k, p in enumerate((1, 2, 6))]
        coloured = material("distortion", attribute=surface.COLOUR_ATTRIBUTE)
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
        backdrop()
        ink = material("ink", (0.02, 0.02, 0.025), 0.8)
        for ob, p in zip(tubes, (1, 2, 6)):
            ahead = CAMERA.y / (CAMERA.y + 2.4)  # nearer by so much, and seen below the tube all the same
            write(f"p = {p}", (CAMERA.x + (ob.location.x - CAMERA.x) / ahead, -2.4, 0.05), 0.38, "CENTER", ink)
        legend(ink)
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
