extends Node
## Swings the head of the bar, as a game would move a handle.

@onready var head: LpdeformHandle = $"../Bar/Head"

var _seconds := 0.0


func _process(seconds: float) -> void:
	_seconds += seconds
	var angle := 0.9 * sin(2 * _seconds)
	head.transform = Transform3D(Basis(Vector3.BACK, -angle), Vector3(sin(angle), 0.3 + 0.7 * cos(angle), 0))
