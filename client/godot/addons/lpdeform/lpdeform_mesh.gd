@tool
@icon("mesh.svg")
class_name LpdeformMesh
extends MeshInstance3D
## A mesh that follows its handles, which are [LpdeformHandle]s below it. An lpdeform server computes its shape.
##
## It is live in the game, and in the editor if [member live_in_editor] is on. Nothing here waits for the network, except
## [method take_better_shape]. While the server
## cannot be reached, the last shape stays.

## Of this add-on.
const VERSION := "0.1.0"

## The mesh has another shape now.
signal deformed
## Something went wrong; the text is also in the output.
signal failed(text: String)

## The mesh at rest, of triangles, with its materials. Vertices in the same place move as one. `mesh` is the deformed mesh, which is
## not kept in the scene.
@export var source: Mesh:
	set(value):
		if source:
			source.changed.disconnect(_begin_soon)
		source = value
		if source:
			source.changed.connect(_begin_soon)
		_begin_soon()

## The server: "host:port", or "unix:/path" on the same machine. If the add-on was built with a library of deploy/engine-library, the Envoy
## in front of the server: "host:port", "http://host:port" or "https://host:port"; "localhost:8080" with deploy/up.
@export var address := "localhost:50051":
	set(value):
		address = value
		_begin_soon()

## Connect by TLS, trusting the authorities that the system trusts.
@export var tls := false:
	set(value):
		tls = value
		_begin_soon()

## The p of the energy. The larger it is, the more the distortion is spread; below 2 it is gathered in few places.
@export_range(1, 64, 0.01) var p := 2.0:
	set(value):
		p = value
		_set_p()

## Show a shape of lower energy at once when the server has found one. Otherwise the output says that there is one, and
## [method take_better_shape] shows it.
@export var show_better_shapes := false:
	set(value):
		show_better_shapes = value
		_set_p()

## How far the server looks for such shapes while nothing changes. Each unit stands for 12 starts; at 0 there are none. At -1 the server
## decides: 1 where p is below 2, otherwise 0.
@export_range(-1, 1000) var search_effort := -1:
	set(value):
		search_effort = value
		_set_p()

## The share of the energy that such a shape must save; 0 is the server's own, 0.02.
@export_range(0, 1, 0.001) var least_share := 0.02:
	set(value):
		least_share = value
		_set_p()

## Show the distortion as colours from blue (none) to red, in place of the materials of [member source].
@export var show_distortion := false:
	set(value):
		show_distortion = value
		_show()

## Deform the mesh in the editor, too.
@export var live_in_editor := true:
	set(value):
		live_in_editor = value
		_begin_soon()

## A bearer token for servers that ask for one. It is not kept in the scene.
var token := "":
	set(value):
		token = value
		_begin_soon()

## "closed", "connecting", "live", "reconnecting" or "refused".
var state: String:
	get:
		return _session.state() if _session else "closed"

var _session: LpdeformSession
var _surfaces: Array[Array]  # the arrays of each surface of `source`
# Of all surfaces, at rest.
var _positions: PackedVector3Array
var _normals: PackedVector3Array
var _indices: PackedInt32Array
var _held := {}  # LpdeformHandle: _Held
var _has_frame := false
var _trouble := ""
var _last_problem := ""
var _begins_soon := false
var _colour_material := StandardMaterial3D.new()


class _Held:
	var name: StringName
	var radius: float
	var vertices: PackedInt32Array
	var rest: Transform3D
	var count := 0  # of the vertices
	var sent: Transform3D


func _init() -> void:
	_colour_material.vertex_color_use_as_albedo = true


func _enter_tree() -> void:
	_begin_soon()


func _exit_tree() -> void:
	_end()


## The deformed mesh is not kept in the scene: it is made again from `source`.
func _validate_property(property: Dictionary) -> void:
	if property.name == "mesh":
		property.usage = PROPERTY_USAGE_NONE


## Begins again, with the present mesh and handles.
func begin() -> void:
	_begins_soon = false
	_end()
	mesh = source
	if not is_inside_tree() or not source or (Engine.is_editor_hint() and not live_in_editor):
		update_configuration_warnings()
		return
	var wrong := _read_source()
	if wrong == "":
		_session = LpdeformSession.new()
		wrong = _session.open(address, token, tls, _positions, _normals, _indices)
	if wrong != "":
		_fail(wrong)
		_end()
		return
	_last_problem = ""
	_set_p()
	update_configuration_warnings()


## Shows the shape of lower energy that the output has announced. Waits for the server's answer, 30 s at most. False if the mesh is not
## live, if there is no such shape, or if the server does not answer; in the last two cases [signal failed] says why in the next frame.
func take_better_shape() -> bool:
	return _session != null and _session.take_better_shape()


func _begin_soon() -> void:
	if is_inside_tree() and not _begins_soon:
		_begins_soon = true
		begin.call_deferred()  # once for all properties that change together


func _end() -> void:
	_session = null
	_held.clear()
	_surfaces.clear()
	_positions.clear()
	_normals.clear()
	_indices.clear()
	_has_frame = false
	_trouble = ""


## Returns what is wrong.
func _read_source() -> String:
	for surface in source.get_surface_count():
		if source is ArrayMesh and source.surface_get_primitive_type(surface) != Mesh.PRIMITIVE_TRIANGLES:
			return "surface %d of the mesh is not of triangles" % surface
		var arrays := source.surface_get_arrays(surface)
		var corners: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
		var first := _positions.size()
		_surfaces.append(arrays)
		_positions.append_array(corners)
		if arrays[Mesh.ARRAY_NORMAL] != null:
			_normals.append_array(arrays[Mesh.ARRAY_NORMAL])
		if arrays[Mesh.ARRAY_INDEX] != null:
			for index: int in arrays[Mesh.ARRAY_INDEX]:
				_indices.append(first + index)
		else:
			_indices.append_array(PackedInt32Array(range(first, first + corners.size())))
	if _normals.size() != _positions.size():
		_normals.clear()  # the server then computes smooth ones
	return ""


func _process(_seconds: float) -> void:
	if not _session:
		return
	_follow_handles()
	if _session.tick():
		_has_frame = true
		_show()
		deformed.emit()
	var is_over := _session.is_over()
	_say(_session.problem())
	var notice := _session.notice()
	if notice != "":
		print("lpdeform: %s: %s" % [name, notice])
	if is_over:
		_end()
		return
	var trouble := _session.trouble()
	if trouble != "" and _trouble == "":
		_fail("%s; trying again" % trouble)
	elif trouble == "" and _trouble != "":
		print("lpdeform: %s: the server answers" % name)
	_trouble = trouble


func _set_p() -> void:
	if _session:
		_session.set_p(p, show_better_shapes, search_effort, least_share)


func _follow_handles() -> void:
	for handle: Variant in _held.keys():  # which may have been freed
		if not is_instance_valid(handle) or handle.get_parent() != self or not handle.hold:
			_session.let_go(_held[handle].name)
			_held.erase(handle)
	for child in get_children():
		var handle := child as LpdeformHandle
		if handle and handle.hold:
			_follow(handle)


func _follow(handle: LpdeformHandle) -> void:
	var held: _Held = _held.get(handle)
	if held and held.name != handle.name:
		_session.let_go(held.name)
		held = null
	if not held or held.radius != handle.radius or held.vertices != handle.vertices or held.rest != handle.rest:
		held = _hold(handle)
		_held[handle] = held
	var can_move := handle.transform.is_finite() and handle.basis.determinant() != 0
	if held.count > 0 and handle.transform != held.sent and can_move:
		# What takes the place at rest to the present one: x -> turn x + shift.
		var turn := (handle.transform.basis * handle.rest.basis.inverse()).get_rotation_quaternion()
		_session.move(held.name, turn, handle.position - turn * handle.rest.origin)
		held.sent = handle.transform  # also if it was refused: it is said once


func _hold(handle: LpdeformHandle) -> _Held:
	var held := _Held.new()
	held.name = handle.name
	held.radius = handle.radius
	held.vertices = handle.vertices
	held.rest = handle.rest
	held.sent = handle.rest
	var numbers := handle.vertices
	if numbers.is_empty():
		for vertex in _positions.size():
			if _positions[vertex].distance_to(handle.rest.origin) < handle.radius:
				numbers.append(vertex)
	if numbers.is_empty():
		_session.let_go(held.name)
		_say("no vertex is within %s of where the handle %s was on the mesh at rest" % [handle.radius, handle.name])
	elif _session.hold(held.name, numbers):
		held.count = numbers.size()
	return held


func _show() -> void:
	if not _has_frame:
		return
	var positions := _session.positions()
	var normals := _session.normals()
	var colours := _session.colours() if show_distortion else PackedColorArray()
	var shape := ArrayMesh.new()
	var first := 0
	for surface in _surfaces.size():
		var arrays := _surfaces[surface].duplicate()
		var last: int = first + arrays[Mesh.ARRAY_VERTEX].size()
		arrays[Mesh.ARRAY_VERTEX] = positions.slice(first, last)
		arrays[Mesh.ARRAY_NORMAL] = normals.slice(first, last)
		if show_distortion:
			arrays[Mesh.ARRAY_COLOR] = colours.slice(first, last)
		shape.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
		shape.surface_set_material(surface, _colour_material if show_distortion else source.surface_get_material(surface))
		first = last
	mesh = shape  # a new one: clearing the surfaces of the old one would clear the node's materials of surfaces, too


func _say(text: String) -> void:
	if text != "":
		_fail(text)


func _fail(text: String) -> void:
	push_warning("lpdeform: %s: %s" % [get_path() if is_inside_tree() else NodePath(name), text])
	_last_problem = text
	update_configuration_warnings()
	failed.emit(text)


func _get_configuration_warnings() -> PackedStringArray:
	var warnings := PackedStringArray()
	if not source:
		warnings.append("There is no mesh to deform. Set `source`.")
	if not get_children().any(func(child: Node) -> bool: return child is LpdeformHandle):
		warnings.append("Nothing holds the mesh. Add LpdeformHandles as children.")
	if _last_problem != "":
		warnings.append(_last_problem)
	return warnings
