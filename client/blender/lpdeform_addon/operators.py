"""What buttons do."""

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from . import bake, handles, live, surface
from .client import NotReady, lpdeform


def mesh_of(context):
    """The mesh to work on: the active object, or the mesh that the active empty belongs to."""
    active = context.object
    if active is None:
        return None
    return active if active.type == "MESH" else active.lpdeform_handle.mesh


def _selected_handles(context) -> list:
    return [one for one in context.selected_objects if one.lpdeform_handle.number > 0]


class AddHandle(bpy.types.Operator):
    """Make an empty that holds the selected vertices; moving it moves the mesh"""

    bl_idname = "lpdeform.add_handle"
    bl_label = "Add handle"
    bl_options = {"REGISTER", "UNDO"}

    in_faces: BoolProperty(name="In faces", default=False, description="Hold the middles of the selected faces in place of vertices")

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH"

    def execute(self, context):
        ob = context.object
        if ob.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        rest = surface.rest_positions(ob)
        chosen = surface.selected_faces(ob) if self.in_faces else surface.selected(ob)
        if not len(chosen):
            what = "faces in Edit mode whose middles" if self.in_faces else "vertices in Edit mode that"
            self.report({"ERROR"}, f"Select the {what} the handle is to hold.")
            return {"CANCELLED"}
        empty = handles.add_in_faces(ob, chosen, rest) if self.in_faces else handles.add(ob, chosen, rest)
        running = live.of(ob)
        if running is not None:
            running.vertices_changed(ob)
        for one in context.selected_objects:
            one.select_set(False)
        empty.select_set(True)
        context.view_layer.objects.active = empty
        return {"FINISHED"}


class RemoveHandle(bpy.types.Operator):
    """Release the vertices of the selected handles and delete their empties"""

    bl_idname = "lpdeform.remove_handle"
    bl_label = "Remove handle"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(_selected_handles(context))

    def execute(self, context):
        meshes = set()
        for empty in _selected_handles(context):
            meshes.add(empty.lpdeform_handle.mesh)
            handles.remove(empty)
        for ob in meshes:
            running = live.of(ob)
            if running is not None:
                running.vertices_changed(ob)
        return {"FINISHED"}


class PutBack(bpy.types.Operator):
    """Put the selected handles back to where they hold their vertices at rest"""

    bl_idname = "lpdeform.put_back"
    bl_label = "Put back"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return any(one.lpdeform_handle.mesh for one in _selected_handles(context))

    def execute(self, context):
        for empty in _selected_handles(context):
            if empty.lpdeform_handle.mesh is not None:
                handles.put_back(empty)
        return {"FINISHED"}


class Start(bpy.types.Operator):
    """Connect the mesh to the lpdeform server; from now on it follows its handles"""

    bl_idname = "lpdeform.start"
    bl_label = "Go live"
    bl_options = {"UNDO"}  # so that the first undo does not revert this

    @classmethod
    def poll(cls, context):
        ob = mesh_of(context)
        return ob is not None and ob.mode != "EDIT" and live.of(ob) is None

    def execute(self, context):
        try:
            live.start(mesh_of(context))
        except NotReady as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class Stop(bpy.types.Operator):
    """End live deformation and go back to the mesh at rest"""

    bl_idname = "lpdeform.stop"
    bl_label = "Stop"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        return live.of(mesh_of(context)) is not None

    def execute(self, context):
        live.stop(mesh_of(context))
        return {"FINISHED"}


class Solve(bpy.types.Operator):
    """Wait for the finished result, with a bound on its distance from the optimum for its rotations"""

    bl_idname = "lpdeform.solve"
    bl_label = "Solve"

    timeout: FloatProperty(name="Seconds", default=60.0, min=0.0, description="The longest time to wait")

    @classmethod
    def poll(cls, context):
        ob = mesh_of(context)
        return live.of(ob) is not None and ob.mode != "EDIT"

    def execute(self, context):
        ob, manager = mesh_of(context), context.window_manager
        running = live.of(ob)
        manager.progress_begin(0, 10_000)
        try:
            running.solve(ob, lambda told: manager.progress_update(min(told.iteration, 9999)), self.timeout)
        except (NotReady, lpdeform.LpdeformError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        result = running.result
        self.report({"INFO"}, f"{result.stop_reason} after {result.iterations} iterations; {result.searched}")
        return {"FINISHED"}


class TakeBetter(bpy.types.Operator):
    """Shows the shape of lower energy that the server has found."""

    bl_idname = "lpdeform.take_better"
    bl_label = "Take the better shape"

    @classmethod
    def poll(cls, context):
        running = live.of(mesh_of(context))
        return running is not None and running.has_better

    def execute(self, context):
        try:
            live.of(mesh_of(context)).session.take_better_shape()
        except lpdeform.LpdeformError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class Apply(bpy.types.Operator):
    """End live deformation and keep the present pose as a shape key"""

    bl_idname = "lpdeform.apply"
    bl_label = "Apply as shape key"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Name", default="Pose")

    @classmethod
    def poll(cls, context):
        running = live.of(mesh_of(context))
        return running is not None and running.shown is not None

    def execute(self, context):
        live.stop(mesh_of(context), keep_as=self.name or "Pose")
        return {"FINISHED"}


class Bake(bpy.types.Operator):
    """Solve every frame of the scene, end live deformation, and keep the results as shape keys with keyframes, so that a render
    follows. Escape changes nothing"""

    bl_idname = "lpdeform.bake"
    bl_label = "Bake frames"
    bl_options = {"UNDO"}

    first: IntProperty(name="First", options={"SKIP_SAVE"}, description="The first frame; if not given, the scene's")
    last: IntProperty(name="Last", options={"SKIP_SAVE"}, description="The last frame; if not given, the scene's")
    step: IntProperty(name="Step", min=1, options={"SKIP_SAVE"}, description="From frame to frame; if not given, the scene's")

    @classmethod
    def poll(cls, context):
        ob = mesh_of(context)
        return live.of(ob) is not None and ob.mode != "EDIT"

    def execute(self, context):
        """Waits for all frames."""
        try:
            self._begin(context)
            while not self._baking.step():
                pass
        except (NotReady, lpdeform.LpdeformError) as error:
            return self._fail(context, str(error))
        return self._finish(context)

    def invoke(self, context, event):
        """Goes on beside Blender's window until it is finished, or Escape is pressed."""
        try:
            self._begin(context)
        except NotReady as error:
            return self._fail(context, str(error))
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            return self._fail(context, "")
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            is_finished = self._baking.step()
        except (NotReady, lpdeform.LpdeformError) as error:
            return self._fail(context, str(error))
        context.window_manager.progress_update(self._baking.done)
        context.workspace.status_text_set(None if is_finished else self._baking.said)
        return self._finish(context) if is_finished else {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender ends the operator, as before another file is opened."""
        self._fail(context, "")

    def _begin(self, context) -> None:
        scene = context.scene
        self._baking = self._timer = None
        first, last, step = (
            getattr(self, name) if self.properties.is_property_set(name) else of_scene
            for name, of_scene in (("first", scene.frame_start), ("last", scene.frame_end), ("step", scene.frame_step))
        )
        self._baking = bake.Baking(mesh_of(context), range(first, last + 1, step))
        context.window_manager.progress_begin(0, len(range(first, last + 1, step)))

    def _finish(self, context):
        self._baking.finish()
        self._end(context)
        self.report({"INFO"}, f"{self._baking.done} frames are kept as shape keys")
        return {"FINISHED"}

    def _fail(self, context, why: str):
        if self._baking is not None:
            self._baking.cancel()
            self._end(context)
        if why:
            self.report({"ERROR"}, f"{why} Nothing was baked.")
        return {"CANCELLED"}

    def _end(self, context) -> None:
        context.window_manager.progress_end()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.workspace.status_text_set(None)


register, unregister = bpy.utils.register_classes_factory((AddHandle, RemoveHandle, PutBack, Start, Stop, Solve, TakeBetter, Apply, Bake))
