"""What client/blender/README.md tells users to do, by the operators behind the buttons: the add-on is installed from its zip,
a vertex of a cube is held at each end, the mesh is taken live, and an empty is moved.   blender --background --python
in_blender.py -- ADD_ON.zip"""

import sys
import time

import bpy


def add_handle(cube, is_held):
    bpy.context.view_layer.objects.active = cube
    cube.select_set(True)
    for elements in (cube.data.edges, cube.data.polygons):
        elements.foreach_set("select", [False] * len(elements))
    for vertex in cube.data.vertices:
        vertex.select = is_held(vertex)
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.lpdeform.add_handle() == {"FINISHED"}
    return bpy.context.object


def main(add_on):
    bpy.ops.preferences.addon_install(filepath=add_on)
    bpy.ops.preferences.addon_enable(module="lpdeform_addon")
    from lpdeform_addon import live

    cube = bpy.data.objects["Cube"]  # that Blender begins with: 2 wide, its middle at the origin
    add_handle(cube, lambda vertex: vertex.co.z < 0)
    top = add_handle(cube, lambda vertex: vertex.co.z > 0)
    assert bpy.ops.lpdeform.start() == {"FINISHED"}
    top.location.z += 1
    deadline = time.monotonic() + 60
    height = 0.0
    while abs(height - 2) > 1e-5 and time.monotonic() < deadline:  # Blender's timers do not run without a window
        bpy.context.view_layer.update()
        live.tick()
        shown = cube.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        height = max(vertex.co.z for vertex in shown.vertices)
        time.sleep(0.01)
    bpy.context.view_layer.objects.active = cube
    assert bpy.ops.lpdeform.apply() == {"FINISHED"}
    assert "Pose" in cube.data.shape_keys.key_blocks
    print(f"{height - 1:.4g}", flush=True)


main(sys.argv[-1])
