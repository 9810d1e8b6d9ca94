"""What the file keeps: settings of a mesh, what an empty holds, and the server's address in the preferences."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty

from . import holds


class MeshSettings(bpy.types.PropertyGroup):
    """Of a mesh object."""

    p: FloatProperty(
        name="p", default=2.0, min=1.0, max=64.0, soft_max=10.0,
        description="1 gathers distortion in creases, 2 spreads it evenly, more avoids peaks",
    )  # fmt: skip
    p_group: StringProperty(name="Paint", description="Vertex group: weight 0 is p, weight 1 the painted p")
    p_painted: FloatProperty(name="Painted p", default=1.0, min=1.0, max=64.0, soft_max=10.0, description="p at weight 1")
    stiffness: FloatProperty(
        name="Stiffness", default=1.0, min=1e-6, max=1e6, soft_min=0.01, soft_max=100.0,
        description="What distortion costs",
    )  # fmt: skip
    stiffness_group: StringProperty(
        name="Paint", description="Vertex group: weight 0 is the stiffness, weight 1 the painted one, between them by powers"
    )
    stiffness_painted: FloatProperty(
        name="Painted stiffness", default=100.0, min=1e-6, max=1e6, soft_min=0.01, soft_max=100.0,
        description="Stiffness at weight 1",
    )  # fmt: skip
    p_automatic: FloatProperty(
        name="p by shape", default=0.0, min=0.0, max=1.0,
        description="The geometry chooses p, with this strength; 0: the values above",
    )  # fmt: skip
    stiffness_automatic: FloatProperty(
        name="Stiffness by shape", default=0.0, min=0.0, max=1.0,
        description="The geometry chooses the stiffness, with this strength; 0: the values above",
    )  # fmt: skip
    region_group: StringProperty(
        name="Region", description="Vertex group: only vertices with a weight over 0.5 may move. Empty: all vertices may move"
    )
    resize: FloatVectorProperty(
        name="Resize", default=(1.0, 1.0, 1.0), min=1.0, max=100.0, soft_max=4.0, size=3, subtype="XYZ",
        description="Stretches the mesh along its own axes; salient parts keep their shape. To make it smaller along one axis, "
        "scale the object down and stretch it along the others. Sets p and stiffness meanwhile",
    )  # fmt: skip
    weld: BoolProperty(
        name="Weld", default=False,
        description="Welds vertices in the same place, so that the mesh holds together where it is split. Handles and paint must "
        "be the same for all of them",
    )  # fmt: skip
    certify: BoolProperty(
        name="Bound", default=False, description="Reports a bound on a result's distance from the optimum for its rotations. Takes effect at the next start"
    )
    search_effort: IntProperty(
        name="Search", default=-1, min=-1, max=1000, soft_max=16,
        description="How far the server looks for shapes of lower energy, while nothing changes and in Solve. Each unit stands for 12 "
        "starts; at 0 there are none. At -1 the server decides: 1 while nothing changes if p is below 2, otherwise 0",
    )  # fmt: skip
    search_percent: FloatProperty(
        name="Least saving", default=2.0, min=0.0, max=100.0, subtype="PERCENTAGE",
        description="The share of the energy that such a shape must save to be announced or shown; 0: the server's own, 2 %",
    )  # fmt: skip
    search_shows: BoolProperty(name="Show at once", default=False, description="Shows such a shape as soon as the server has found it")
    show_distortion: BoolProperty(
        name="As colour", default=True, description="Fills the colour attribute lpdeform distortion"
    )
    distortion_limit: FloatProperty(
        name="Red from", default=0.0, min=0.0, description="The distortion shown in red, in the mesh's unit; 0: the largest"
    )


class HandleSettings(bpy.types.PropertyGroup):
    """Of an empty that holds vertices of a mesh."""

    mesh: PointerProperty(type=bpy.types.Object, name="Mesh")
    number: IntProperty(name="Number", description="The value of its vertices in the mesh's attribute lpdeform_handle; 0: it holds none")
    rest: FloatVectorProperty(name="Rest", size=16, description="Its matrix at rest, in the mesh's own space, row by row")
    kind: EnumProperty(name="Hold", items=holds.ITEMS, default="EXACT")
    weight: FloatProperty(
        name="Weight", default=1.0, min=0.0, max=1e6, soft_max=100.0, description="For soft and orientation handles"
    )
    footprint: FloatProperty(
        name="Footprint", default=0.0, min=0.0, unit="LENGTH",
        description="Radius of a region that moves along nearly rigidly, against spikes at single vertices",
    )  # fmt: skip


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    address: StringProperty(
        name="Server", default="",
        description="HOST:PORT of the lpdeform server. Empty: the environment variable LPDEFORM_ADDRESS, or localhost:50051",
    )  # fmt: skip

    token_file: StringProperty(
        name="Token file", default="", subtype="FILE_PATH",
        description="A file with the bearer token that the server asks for; read again for each call. Empty: none",
    )  # fmt: skip
    use_tls: BoolProperty(name="TLS", default=False, description="Connect with TLS")
    root_certificates: StringProperty(
        name="Trusted", default="", subtype="FILE_PATH", description="Certificates to trust, in PEM. Empty: the default ones"
    )
    certificate_chain: StringProperty(
        name="Own certificate", default="", subtype="FILE_PATH", description="In PEM, if the server asks for one"
    )
    private_key: StringProperty(name="Its key", default="", subtype="FILE_PATH", description="In PEM, without a password")

    def draw(self, context) -> None:
        self.layout.use_property_split = True
        for name in ("address", "token_file", "use_tls"):
            self.layout.prop(self, name)
        if self.use_tls:
            for name in ("root_certificates", "certificate_chain", "private_key"):
                self.layout.prop(self, name)


_register_classes, _unregister_classes = bpy.utils.register_classes_factory((MeshSettings, HandleSettings, Preferences))


def register() -> None:
    _register_classes()
    bpy.types.Object.lpdeform = PointerProperty(type=MeshSettings)
    bpy.types.Object.lpdeform_handle = PointerProperty(type=HandleSettings)


def unregister() -> None:
    del bpy.types.Object.lpdeform_handle
    del bpy.types.Object.lpdeform
    _unregister_classes()
