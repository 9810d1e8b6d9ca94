"""Converts arrays from and to a Blender mesh. Only the reading of vertex groups loops over vertices, because Blender 3.4 has
no other way."""

import numpy as np

HANDLE_ATTRIBUTE = "lpdeform_handle"
FACE_ATTRIBUTE = "lpdeform_handle_face"
COLOUR_ATTRIBUTE = "lpdeform distortion"
LIVE_KEY = "lpdeform"

# Blue, cyan, green, yellow, red at equal steps: linear RGB.
_stops = np.linspace(0.0, 1.0, 5)
_ramp = np.array([[0.02, 0.08, 0.55], [0.0, 0.45, 0.75], [0.1, 0.65, 0.15], [0.95, 0.75, 0.05], [0.75, 0.02, 0.02]])


def rest_positions(ob) -> np.ndarray:
    """n x 3, in the object's own space: positions of the basis, if there are shape keys."""
    keys = ob.data.shape_keys
    source = _points(keys.reference_key) if keys is not None else ob.data.vertices
    positions = np.empty(3 * len(ob.data.vertices), np.float32)
    source.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def triangles(ob) -> np.ndarray:
    """m x 3: Blender's own triangulation of the faces."""
    ob.data.calc_loop_triangles()
    corners = np.empty(3 * len(ob.data.loop_triangles), np.int32)
    ob.data.loop_triangles.foreach_get("vertices", corners)
    return corners.reshape(-1, 3)


def selected(ob) -> np.ndarray:
    """Indices of the vertices selected in Edit mode; call it in Object mode."""
    mask = np.empty(len(ob.data.vertices), bool)
    ob.data.vertices.foreach_get("select", mask)
    return np.flatnonzero(mask)


def selected_faces(ob) -> np.ndarray:
    """Indices of the faces selected in Edit mode; call it in Object mode."""
    mask = np.empty(len(ob.data.polygons), bool)
    ob.data.polygons.foreach_get("select", mask)
    return np.flatnonzero(mask)


def held(ob) -> np.ndarray:
    """For each vertex the number of the handle that holds it; 0 if none does."""
    return _numbers(ob, HANDLE_ATTRIBUTE, len(ob.data.vertices))


def set_held(ob, numbers: np.ndarray) -> None:
    _set_numbers(ob, HANDLE_ATTRIBUTE, "POINT", numbers)


def held_faces(ob) -> np.ndarray:
    """For each face the number of the handle that holds its middle; 0 if none does."""
    return _numbers(ob, FACE_ATTRIBUTE, len(ob.data.polygons))


def set_held_faces(ob, numbers: np.ndarray) -> None:
    _set_numbers(ob, FACE_ATTRIBUTE, "FACE", numbers)


def _numbers(ob, name: str, count: int) -> np.ndarray:
    attribute = ob.data.attributes.get(name)
    numbers = np.zeros(count, np.int32)
    if attribute is not None and len(attribute.data) == count:
        attribute.data.foreach_get("value", numbers)
    return numbers


def _set_numbers(ob, name: str, domain: str, numbers: np.ndarray) -> None:
    attribute = ob.data.attributes.get(name)
    if attribute is None:
        attribute = ob.data.attributes.new(name, "INT", domain)
    attribute.data.foreach_set("value", numbers.astype(np.int32))


def middles(ob, faces, rest: np.ndarray):
    """Middles of faces: k indices into triangles(), k x 3 barycentric coordinates in them, and k x 3 positions at rest."""
    corners = triangles(ob)
    face_of = np.empty(len(corners), np.int32)
    ob.data.loop_triangles.foreach_get("polygon_index", face_of)
    found, coordinates = [], []
    for face in faces:
        middle = rest[list(ob.data.polygons[face].vertices)].mean(axis=0)
        inside = np.flatnonzero(face_of == face)
        inner = [_barycentric(rest[corners[one]], middle) for one in inside]
        best = int(np.argmax([one.min() for one in inner]))
        within = np.maximum(inner[best], 0.0)  # the middle of a bent face is not on its triangles
        found.append(inside[best])
        coordinates.append(within / within.sum())
    found, coordinates = np.array(found, np.int64), np.array(coordinates).reshape(-1, 3)
    return found, coordinates, np.einsum("kc,kcx->kx", coordinates, rest[corners[found]])


def _barycentric(triangle: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Barycentric coordinates of the point of the triangle's plane that is nearest to `point`."""
    sides = (triangle[1:] - triangle[0]).astype(float)
    b, c = np.linalg.lstsq(sides.T, point - triangle[0], rcond=None)[0]
    return np.array([1 - b - c, b, c])


def group_weights(ob, name: str):
    """One weight per vertex, 0 outside the group; None if there is no such group."""
    group = ob.vertex_groups.get(name) if name else None
    if group is None:
        return None
    index = group.index
    weights = np.zeros(len(ob.data.vertices))
    for vertex in ob.data.vertices:
        for one in vertex.groups:
            if one.group == index:
                weights[vertex.index] = one.weight
    return weights


def live_key(ob):
    keys = ob.data.shape_keys
    return keys.key_blocks.get(LIVE_KEY) if keys is not None else None


def add_live_key(ob) -> list:
    """Adds the key that frames are written to, above the basis, which does not change. Mutes other keys and returns their
    names."""
    if ob.data.shape_keys is None:
        ob.shape_key_add(name="Basis", from_mix=False)
    key = live_key(ob) or ob.shape_key_add(name=LIVE_KEY, from_mix=False)
    keys = ob.data.shape_keys
    others = [one for one in keys.key_blocks if one not in (keys.reference_key, key) and not one.mute]
    for one in others:
        one.mute = True
    key.value, key.mute = 1.0, False
    ob.active_shape_key_index = 0  # Edit mode continues to edit the basis
    return [one.name for one in others]


def drop_live_key(ob, muted: list, had_keys: bool) -> None:
    """Reverses add_live_key(). `had_keys`: whether there were shape keys before it."""
    key = live_key(ob)
    if key is not None:
        ob.shape_key_remove(key)
    keys = ob.data.shape_keys
    if keys is None:
        return
    for name in muted:
        if name in keys.key_blocks:
            keys.key_blocks[name].mute = False
    if not had_keys and len(keys.key_blocks) == 1:
        ob.shape_key_clear()


def set_positions(key, positions: np.ndarray) -> None:
    _points(key).foreach_set("co", np.ascontiguousarray(positions, np.float32).reshape(-1))


def show_positions(ob, positions: np.ndarray) -> None:
    set_positions(live_key(ob), positions)
    ob.data.update_tag()


def _points(key):
    """Blender 4.1 and newer copy an array from and to these at once. Older ones have only `data`, which takes each vertex by itself."""
    return key.points if hasattr(key, "points") else key.data


def colours(distortion: np.ndarray, limit: float) -> np.ndarray:
    """n x 4: from blue for none to red at the limit. A limit of 0 means the largest distortion."""
    most = limit if limit > 0 else float(distortion.max(initial=0.0))
    share = np.clip(distortion / most, 0.0, 1.0) if most > 0 else np.zeros(len(distortion))
    out = np.ones((len(distortion), 4), np.float32)
    for channel in range(3):
        out[:, channel] = np.interp(share, _stops, _ramp[:, channel])
    return out


def show_distortion(ob, distortion: np.ndarray, limit: float) -> None:
    attribute = ob.data.color_attributes.get(COLOUR_ATTRIBUTE)
    if attribute is None:
        attribute = ob.data.color_attributes.new(COLOUR_ATTRIBUTE, "FLOAT_COLOR", "POINT")
        ob.data.color_attributes.active_color = attribute
    attribute.data.foreach_set("color", colours(distortion, limit).reshape(-1))
