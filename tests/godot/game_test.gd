extends SceneTree
## The add-on in a game, against a real server:   godot --path PROJECT --script game_test.gd -- ADDRESS [SCREENSHOT.png]
## Prints a line per test, and ends with 1 if one failed.

const SECONDS := 60

var _address: String
var _screenshot := ""
var _failed := 0
var _wrong := ""
var _texts: PackedStringArray


func _initialize() -> void:
	_run.call_deferred()


func _run() -> void:
	var arguments := OS.get_cmdline_user_args()
	_address = arguments[0]
	if arguments.size() > 1:
		_screenshot = arguments[1]
	for test: Callable in [follows_a_handle, shows_distortion, lets_go, moves_listed_vertices, keeps_surfaces_apart, says_what_is_refused,
			says_that_there_is_no_server, names_a_handle_that_holds_nothing, refuses_other_than_triangles, checks_calls_without_types,
			measures_a_frame]:
		_wrong = ""
		await test.call()
		print("%s %s%s" % ["passed" if _wrong == "" else "FAILED", test.get_method(), "" if _wrong == "" else ": " + _wrong])
		if _wrong != "":
			_failed += 1
	quit(1 if _failed > 0 else 0)


func expect(holds: bool, what: String) -> void:
	if not holds and _wrong == "":
		_wrong = what


func until(holds: Callable, what: String) -> void:
	var end := Time.get_ticks_msec() + 1000 * SECONDS
	while not holds.call():
		if Time.get_ticks_msec() > end:
			expect(false, "not within %d seconds: %s; %s" % [SECONDS, what, conditions()])
			return
		await process_frame


## What the meshes and their handles are in, for the text of a failure.
func conditions() -> String:
	var text := ""
	for bar: LpdeformMesh in root.find_children("*", "MeshInstance3D", true, false):
		text += "%s is %s" % [bar.get_path(), bar.state]
		for handle: LpdeformHandle in bar._held:
			var held: Variant = bar._held[handle]
			text += ", %s holds %d and is at %s (sent %s, rest %s)" % [held.name, held.count, handle.transform, held.sent, held.rest]
		if bar._session and bar.mesh:
			var off := 0.0
			var shown := vertices(bar.mesh)
			var known: PackedVector3Array = bar._session.positions()
			for vertex in shown.size():
				off = maxf(off, shown[vertex].distance_to(known[vertex]))
			text += ", what is shown is %f off the newest frame" % off
	return text


## The sample without what moves its head.
func open_sample() -> Node3D:
	var scene: Node3D = load("res://sample.tscn").instantiate()
	scene.get_node("Swing").free()
	bar_of(scene).address = _address
	root.add_child(scene)
	return scene


func bar_of(scene: Node3D) -> LpdeformMesh:
	return scene.get_node("Bar")


func listen(bar: LpdeformMesh) -> void:
	_texts.clear()
	bar.failed.connect(func(text: String) -> void: _texts.append(text))


func vertices(mesh: Mesh, surface := 0) -> PackedVector3Array:
	return mesh.surface_get_arrays(surface)[Mesh.ARRAY_VERTEX]


## Six times the volume, negative for triangles that are clockwise seen from outside.
func volume(arrays: Array) -> float:
	var at: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
	var corners: PackedInt32Array = arrays[Mesh.ARRAY_INDEX]
	var sum := 0.0
	for k in range(0, corners.size(), 3):
		sum += at[corners[k]].dot(at[corners[k + 1]].cross(at[corners[k + 2]]))
	return sum


func turned() -> Transform3D:
	return Transform3D(Basis(Vector3.BACK, -1.2), Vector3(0.9, 0.5, 0))


func follows_a_handle() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	var rest := vertices(bar.source)
	var head: LpdeformHandle = bar.get_node("Head")
	await process_frame
	head.transform = turned()
	var motion := turned() * Transform3D(Basis(), Vector3(0, 1, 0)).affine_inverse()
	var top := -1
	for vertex in rest.size():
		if rest[vertex].y == 1 and rest[vertex].distance_to(Vector3(0, 1, 0)) < 0.25:
			top = vertex
	await until(func() -> bool: return vertices(bar.mesh)[top].distance_to(motion * rest[top]) < 1e-4, "the head follows")
	var arrays := bar.mesh.surface_get_arrays(0)
	var now: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
	expect(bar.mesh is ArrayMesh, "the shape is an ArrayMesh")
	expect(now.size() == rest.size(), "the number of vertices stays")
	for vertex in rest.size():
		expect(now[vertex].is_finite(), "vertex %d is finite" % vertex)
		if rest[vertex].y == -1 and Vector2(rest[vertex].x, rest[vertex].z).length() < 0.2:
			expect(now[vertex].distance_to(rest[vertex]) < 1e-5, "the foot stays")
	var before := volume(bar.source.surface_get_arrays(0))
	var after := volume(arrays)
	expect(before < 0 and after < 0.5 * before, "the triangles' sides stay: %f, then %f" % [before, after])
	expect(bar.state == "live", "state is " + bar.state)
	expect(bar.mesh.surface_get_material(0) == bar.source.surface_get_material(0), "the material stays")
	var normals: PackedVector3Array = arrays[Mesh.ARRAY_NORMAL]
	var rest_normals: PackedVector3Array = bar.source.surface_get_arrays(0)[Mesh.ARRAY_NORMAL]
	expect(normals[top].distance_to(motion.basis * rest_normals[top]) < 0.2, "normals turn with the head")
	if _screenshot != "":
		await picture(_screenshot)
	scene.free()


func picture(file: String) -> void:
	for _k in 5:
		await process_frame
	await RenderingServer.frame_post_draw
	expect(root.get_texture().get_image().save_png(file) == OK, "the screenshot is written")


func shows_distortion() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	bar.show_distortion = true
	await process_frame
	(bar.get_node("Head") as LpdeformHandle).transform = turned()
	var colours := func() -> Variant: return bar.mesh.surface_get_arrays(0)[Mesh.ARRAY_COLOR]
	await until(func() -> bool: return colours.call() != null, "there are colours")
	await until(func() -> bool: return Array(colours.call()).any(func(c: Color) -> bool: return c.r > 0.9 and c.b < 0.5), "one is red")
	if _screenshot != "":
		await picture(_screenshot.replace(".png", "-distortion.png"))
	bar.show_distortion = false
	expect(colours.call() == null, "the colours go")
	scene.free()


func lets_go() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	var head: LpdeformHandle = bar.get_node("Head")
	await until(func() -> bool: return bar.mesh != null, "the session begins")
	head.position.y += 0.5
	var height := func() -> float:
		var most := -INF
		for at in vertices(bar.mesh):
			most = maxf(most, at.y)
		return most
	await until(func() -> bool: return absf(height.call() - 1.5) < 1e-4, "the bar is longer")
	bar.p = 4
	head.hold = false
	await until(func() -> bool: return absf(height.call() - 1) < 1e-2, "the bar goes back")
	expect(not head.has_rest(), "the handle has no place at rest")
	head.position.y = 1
	head.hold = true
	head.name = "Top"  # renamed while it holds
	await process_frame
	head.position.y = 1.25
	await until(func() -> bool: return absf(height.call() - 1.25) < 1e-4, "the bar follows again")
	head.free()
	await until(func() -> bool: return absf(height.call() - 1) < 1e-2, "a handle that is freed lets go")
	expect(bar.state == "live", "state is " + bar.state)
	scene.free()


func moves_listed_vertices() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	var head: LpdeformHandle = bar.get_node("Head")
	var rest := vertices(bar.source)
	var listed := 0
	for vertex in rest.size():
		if rest[vertex].distance_to(Vector3(0.15, 0.5, 0.15)) < 0.03:
			listed = vertex
	head.vertices = [listed]
	await process_frame
	head.position += Vector3(0.2, 0, 0)
	await until(func() -> bool: return vertices(bar.mesh)[listed].distance_to(rest[listed] + Vector3(0.2, 0, 0)) < 1e-4, "it follows")
	listen(bar)
	head.vertices = [listed, rest.size()]
	await until(func() -> bool: return _texts.size() > 0, "a vertex that does not exist is refused")
	expect("Head" in _texts[0] and str(rest.size()) in _texts[0], "the text names handle and limit: " + str(_texts))
	scene.free()


func keeps_surfaces_apart() -> void:
	var bar := LpdeformMesh.new()
	var mesh := ArrayMesh.new()
	for part in 2:
		var box := BoxMesh.new()
		box.subdivide_height = 4
		var arrays := box.surface_get_arrays(0)
		for k in arrays[Mesh.ARRAY_VERTEX].size():
			arrays[Mesh.ARRAY_VERTEX][k] += Vector3(0, part, 0)
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
		mesh.surface_set_material(part, StandardMaterial3D.new())
	bar.source = mesh
	bar.address = _address
	root.add_child(bar)
	for place: Vector3 in [Vector3(0, -0.5, 0), Vector3(0, 1.5, 0)]:
		var handle := LpdeformHandle.new()
		handle.position = place
		handle.radius = 0.8
		bar.add_child(handle)
		handle.hold = true
	await process_frame
	(bar.get_child(1) as LpdeformHandle).position.x = 0.5
	await until(func() -> bool: return vertices(bar.mesh, 1)[0].x - vertices(mesh, 1)[0].x > 0.4, "the second surface follows")
	expect(bar.mesh.get_surface_count() == 2, "there are two surfaces")
	for part in 2:
		expect(bar.mesh.surface_get_material(part) == mesh.surface_get_material(part), "surface %d has its material" % part)
	bar.free()


func says_what_is_refused() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	listen(bar)
	var arrays := bar.source.surface_get_arrays(0)
	arrays[Mesh.ARRAY_INDEX] = PackedInt32Array([0, 1, 2])
	arrays[Mesh.ARRAY_VERTEX][1] = arrays[Mesh.ARRAY_VERTEX][0]
	var broken := ArrayMesh.new()
	broken.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	bar.source = broken
	await until(func() -> bool: return _texts.size() > 0, "the mesh is refused")
	expect("(" in _texts[0], "the text has a reason: " + str(_texts))
	expect(bar.state == "closed", "state is " + bar.state)
	expect(_texts[0] in bar._get_configuration_warnings(), "the editor would warn")
	expect(bar.mesh == broken, "the mesh is shown as it is")
	scene.free()


func says_that_there_is_no_server() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	bar.address = "127.0.0.1:1"
	listen(bar)
	await until(func() -> bool: return _texts.size() > 0, "it says so")
	expect("127.0.0.1:1" in _texts[0], "the text names the address: " + str(_texts))
	expect(bar.state == "connecting", "state is " + bar.state)
	bar.address = _address  # the user corrects it
	await until(func() -> bool: return bar.state == "live", "it works then")
	expect(bar._get_configuration_warnings().is_empty(), "no warning is left")
	scene.free()


func names_a_handle_that_holds_nothing() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	listen(bar)
	var far := LpdeformHandle.new()
	far.name = "Far"
	far.hold = true
	far.position.x = 7
	bar.add_child(far)
	await until(func() -> bool: return _texts.size() > 0, "it says so")
	expect("Far" in _texts[0] and "0.1" in _texts[0], "the text names handle and radius: " + str(_texts))
	scene.free()


func refuses_other_than_triangles() -> void:
	var scene := open_sample()
	var bar := bar_of(scene)
	listen(bar)
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = PackedVector3Array([Vector3.ZERO, Vector3.ONE])
	var lines := ArrayMesh.new()
	lines.add_surface_from_arrays(Mesh.PRIMITIVE_LINES, arrays)
	bar.source = lines
	await process_frame
	expect("surface 0" in str(_texts), "the text names the surface: " + str(_texts))
	scene.free()


## Scripts without types call by Variants.
func checks_calls_without_types() -> void:
	var session: Variant = ClassDB.instantiate("LpdeformSession")
	expect(session.state() == "closed", "state before open")
	expect(session.positions() == PackedVector3Array(), "no positions before open")
	expect(session.tick() == false and session.hold("a", PackedInt32Array([-1])) == false, "nothing before open")
	var wrong: Variant = session.open(_address, "", false, PackedVector3Array([Vector3.ZERO]), PackedVector3Array(), PackedInt32Array([0, 0]))
	expect(wrong is String and "three a triangle" in wrong, "two indices: " + str(wrong))
	wrong = session.open(_address, "", false, PackedVector3Array([Vector3.ZERO]), PackedVector3Array([Vector3.UP, Vector3.UP]), PackedInt32Array())
	expect("normals" in wrong, "too many normals: " + str(wrong))
	expect(session.call("set_p", 2, true, 4, 0.1) == false, "an int is taken as a float")


func measures_a_frame() -> void:
	var bar := LpdeformMesh.new()
	var grid := PlaneMesh.new()
	grid.size = Vector2(2, 2)
	grid.subdivide_width = 99
	grid.subdivide_depth = 99
	bar.source = grid
	bar.address = _address
	root.add_child(bar)
	for place: Vector3 in [Vector3(-1, 0, 0), Vector3(1, 0, 0)]:
		var handle := LpdeformHandle.new()
		handle.position = place
		handle.radius = 0.3
		bar.add_child(handle)
		handle.hold = true
	var shown := [0]
	bar.deformed.connect(func() -> void: shown[0] += 1)
	await until(func() -> bool: return shown[0] > 0, "the first frame comes")
	var times: Array[int] = []
	for frame in 300:
		(bar.get_child(1) as LpdeformHandle).position.y = 0.5 * sin(0.05 * frame)
		await process_frame
		var before := Time.get_ticks_usec()
		bar._show()
		times.append(Time.get_ticks_usec() - before)
	times.sort()
	await until(func() -> bool: return shown[0] > 20, "frames come")
	print("%d vertices: showing a frame takes %.2f ms (p99 %.2f ms); %d frames came" %
			[vertices(bar.mesh).size(), times[150] / 1000.0, times[297] / 1000.0, shown[0]])
	bar.free()
