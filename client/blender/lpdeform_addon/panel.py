"""The sidebar's tab lpdeform."""

import textwrap

import bpy

from . import holds, live
from .client import address
from .operators import mesh_of

_words = {
    "idle": "Live at {}",
    "connected": "Live at {}",
    "reconnecting": "{} is away; trying again",
    "closed": "Ended",
}


def lines(text: str, width: float) -> list:
    """Splits a text into lines that fit beside an icon in a sidebar of this width in pixels, at Blender's usual text size."""
    return textwrap.wrap(text, max(12, int((width - 60) / 7.5)))


def _say(layout, context, text: str, icon: str) -> None:
    column = layout.column(align=True)
    for line in lines(text, context.region.width / context.preferences.system.ui_scale):
        column.label(text=line, icon=icon)
        icon = "BLANK1"


class MainPanel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_lpdeform"
    bl_label = "lpdeform"
    bl_category = "lpdeform"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context) -> None:
        layout, ob = self.layout, mesh_of(context)
        if ob is None:
            layout.label(text="Select a mesh.", icon="INFO")
            return
        running = live.of(ob)
        if running is None:
            layout.operator("lpdeform.start", icon="PLAY")
        else:
            layout.label(text=_words[running.state].format(address()), icon="LINKED")
            for line in running.proof:
                _say(layout, context, line, "CHECKMARK")
            column = layout.column(align=True)
            column.operator("lpdeform.solve", icon="SHADERFX")
            column.operator("lpdeform.stop", icon="X")
            column.operator("lpdeform.apply", icon="SHAPEKEY_DATA")
            column.operator("lpdeform.bake", icon="RENDER_ANIMATION")
            if running.notice:
                _say(layout, context, running.notice, "TIME")
            if running.has_better:
                layout.operator("lpdeform.take_better", icon="CHECKMARK")
            for notice in running.mesh_notices:
                _say(layout, context, notice, "INFO")
        if live.message(ob):
            _say(layout, context, live.message(ob), "ERROR")
        column = layout.column(align=True)
        column.operator("lpdeform.add_handle", icon="EMPTY_DATA")
        column.operator("lpdeform.add_handle", text="Add handle in faces", icon="SNAP_FACE_CENTER").in_faces = True


class _Below:
    bl_category = "lpdeform"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_parent_id = "VIEW3D_PT_lpdeform"

    @classmethod
    def poll(cls, context):
        return mesh_of(context) is not None


class MaterialPanel(_Below, bpy.types.Panel):
    bl_idname = "VIEW3D_PT_lpdeform_material"
    bl_label = "p and stiffness"

    def draw(self, context) -> None:
        ob = mesh_of(context)
        self.layout.use_property_split = True
        for name in ("p", "stiffness"):
            column = self.layout.column(align=True)
            column.enabled = tuple(ob.lpdeform.resize) == (1.0, 1.0, 1.0)  # which sets both
            column.prop(ob.lpdeform, f"{name}_automatic", text="By shape")
            if getattr(ob.lpdeform, f"{name}_automatic") > 0:
                continue
            column.prop(ob.lpdeform, name)
            column.prop_search(ob.lpdeform, f"{name}_group", ob, "vertex_groups")
            if getattr(ob.lpdeform, f"{name}_group"):
                column.prop(ob.lpdeform, f"{name}_painted")
        self.layout.prop_search(ob.lpdeform, "region_group", ob, "vertex_groups")
        self.layout.prop(ob.lpdeform, "resize")
        self.layout.prop(ob.lpdeform, "weld")
        self.layout.prop(ob.lpdeform, "certify")


class SearchPanel(_Below, bpy.types.Panel):
    bl_idname = "VIEW3D_PT_lpdeform_search"
    bl_label = "Lower minima"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context) -> None:
        self.layout.use_property_split = True
        for name in ("search_effort", "search_percent", "search_shows"):
            self.layout.prop(mesh_of(context).lpdeform, name)


class HandlePanel(_Below, bpy.types.Panel):
    bl_idname = "VIEW3D_PT_lpdeform_handle"
    bl_label = "Handle"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.lpdeform_handle.number > 0

    def draw(self, context) -> None:
        handle, layout = context.object.lpdeform_handle, self.layout
        layout.use_property_split = True
        layout.prop(handle, "kind")
        if holds.KINDS[handle.kind].has_weight:
            layout.prop(handle, "weight")
        layout.prop(handle, "footprint")
        row = layout.row(align=True)
        row.operator("lpdeform.put_back", icon="LOOP_BACK")
        row.operator("lpdeform.remove_handle", text="Remove", icon="TRASH")


class DistortionPanel(_Below, bpy.types.Panel):
    bl_idname = "VIEW3D_PT_lpdeform_distortion"
    bl_label = "Distortion"

    def draw(self, context) -> None:
        settings = mesh_of(context).lpdeform
        self.layout.use_property_split = True
        self.layout.prop(settings, "show_distortion")
        if settings.show_distortion:
            self.layout.prop(settings, "distortion_limit")


register, unregister = bpy.utils.register_classes_factory((MainPanel, MaterialPanel, SearchPanel, HandlePanel, DistortionPanel))
