/* How the structs of lpdeform.h lie in memory, for Layout.cs: a name, the size, the place of the last field. */
#include <lpdeform.h>
#include <stdio.h>

#define TELL(name, type, last) printf("%s %zu %zu\n", name, sizeof(type), offsetof(type, last))

int main(void) {
  TELL("Connection", lpdeform_connection, reconnect_seconds);
  TELL("Attribute", lpdeform_source, reserved);
  TELL("Attribute", lpdeform_target, reserved);
  TELL("Mesh", lpdeform_mesh, weld_groups);
  TELL("Options", lpdeform_options, max_frames_per_second);
  TELL("Motion", lpdeform_motion, positions);
  TELL("Handle", lpdeform_handle, footprint);
  TELL("Settings", lpdeform_settings, reserved_too);
  TELL("Buffers", lpdeform_buffers, red_distortion);
  TELL("Frame", lpdeform_frame, extent);
  printf("Error %zu %zu\n", sizeof(lpdeform_error), offsetof(lpdeform_error, message));
  return 0;
}
