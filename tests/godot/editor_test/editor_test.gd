@tool
extends EditorPlugin
## The add-on in the editor, against a real server:   godot --editor --path PROJECT -- ADDRESS [SCREENSHOT.png]
## Opens the sample, drags a handle as the editor's gizmo does, saves, and opens it again. Prints a line, and ends the editor with 1
## if something is wrong.

var _wrong := ""


func _enter_tree() -> void:
	_run.call_deferred()


func expect(holds: bool, what: String) -> void:
	if not holds and _wrong == "":
		_wrong = what


func until(holds: Callable, what: String) -> void:
	var end := Time.get_ticks_msec() + 60000
	while not holds.call():
		if Time.get_ticks_msec() > end:
			expect(false, "not within 60 seconds: " + what)
			return
		await get_tree().process_frame


func open() -> Node:
	EditorInterface.open_scene_from_path("res://sample.tscn")
	await until(func() -> bool: return EditorInterface.get_edited_scene_root() != null, "the scene opens")
	return EditorInterface.get_edited_scene_root()


## Of vertices of the bar at rest, the number of one at the end that the head holds.
func top_of(bar: Node) -> int:
	return Array(bar.source.surface_get_arrays(0)[Mesh.ARRAY_VERTEX]).find_custom(
			func(at: Vector3) -> bool: return at.y == 1 and Vector2(at.x, at.z).length() < 0.2)


func place(bar: Node, vertex: int) -> Vector3:
	return bar.mesh.surface_get_arrays(0)[Mesh.ARRAY_VERTEX][vertex]


func _run() -> void:
	var arguments := OS.get_cmdline_user_args()
	while EditorInterface.get_resource_filesystem().is_scanning():
		await get_tree().process_frame
	var scene := await open()
	var bar := scene.get_node("Bar")
	bar.address = arguments[0]
	await until(func() -> bool: return bar.state == "live", "the mesh is live")
	expect(bar._get_configuration_warnings().is_empty(), "there are no warnings: " + str(bar._get_configuration_warnings()))
	var top := top_of(bar)
	var rest := place(bar, top)
	var head := bar.get_node("Head")
	EditorInterface.get_selection().add_node(head)
	var undo := get_undo_redo()
	undo.create_action("Move", UndoRedo.MERGE_DISABLE, head)
	undo.add_do_property(head, "position", head.position + Vector3(0.7, -0.2, 0))
	undo.add_undo_property(head, "position", head.position)
	undo.commit_action()
	var moved := rest + Vector3(0.7, -0.2, 0)
	await until(func() -> bool: return place(bar, top).distance_to(moved) < 1e-4, "the mesh follows the gizmo")
	if arguments.size() > 1:
		EditorInterface.set_main_screen_editor("3D")
		await get_tree().create_timer(2).timeout
		expect(get_tree().root.get_texture().get_image().save_png(arguments[1]) == OK, "the screenshot is written")
	EditorInterface.save_scene()
	expect(not "ArrayMesh" in FileAccess.get_file_as_string("res://sample.tscn"), "the deformed mesh is not kept in the scene")

	EditorInterface.reload_scene_from_path("res://sample.tscn")
	bar = (await open()).get_node("Bar")
	expect(bar.address == arguments[0], "the address is kept")
	await until(func() -> bool: return bar.mesh != null, "it has a mesh")
	await until(func() -> bool: return place(bar, top).distance_to(moved) < 1e-4, "the mesh opens deformed, as it was")

	var lonely := LpdeformHandle.new()
	EditorInterface.get_edited_scene_root().add_child(lonely)
	expect("LpdeformMesh" in str(lonely._get_configuration_warnings()), "a handle without a mesh warns")
	bar.source = null
	await get_tree().process_frame
	await get_tree().process_frame
	expect("source" in str(bar._get_configuration_warnings()), "a mesh without a source warns")
	print("passed works_in_the_editor" if _wrong == "" else "FAILED works_in_the_editor: " + _wrong)
	get_tree().quit(0 if _wrong == "" else 1)
