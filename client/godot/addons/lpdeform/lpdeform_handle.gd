@tool
@icon("handle.svg")
class_name LpdeformHandle
extends Marker3D
## A part of the mesh of the [LpdeformMesh] above it. The part moves with this node.
##
## Put the node on the mesh, and switch [member hold] on, in the editor or in the game.

## While this is on, the vertices around the place where it was switched on move with the node. If it is on already when the node
## comes into the scene, that is the place.
@export var hold := false:
	set(value):
		hold = value
		if not is_inside_tree():
			return
		if not hold:
			_rest_before = rest
			_let_go_at = transform
			rest = NOWHERE
		elif transform == _let_go_at:
			rest = _rest_before  # as after an undo
		else:
			take_rest()

## Vertices closer than this to the node are held, in the unit of the mesh.
@export_range(0.001, 10, 0.001, "or_greater") var radius := 0.1

## The numbers of the vertices to hold, over all surfaces of the mesh. If there are any, [member radius] does not count.
@export var vertices := PackedInt32Array()

const NOWHERE := Transform3D(Vector3.ZERO, Vector3.ZERO, Vector3.ZERO, Vector3.ZERO)

# When `hold` was switched off: `rest` before that, and `transform`.
var _rest_before := NOWHERE
var _let_go_at := NOWHERE

## Where the handle was on the mesh at rest, relative to the [LpdeformMesh].
@export_storage var rest := NOWHERE

## True if the handle has a place on the mesh at rest.
func has_rest() -> bool:
	return rest != NOWHERE


## From now on, the node's present place is the one at rest.
func take_rest() -> void:
	rest = transform


func _enter_tree() -> void:
	if hold and not has_rest():
		take_rest()


func _get_configuration_warnings() -> PackedStringArray:
	if get_parent() is LpdeformMesh:
		return []
	return ["This node moves a mesh only as a child of an LpdeformMesh."]
