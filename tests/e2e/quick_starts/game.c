/* What the quick start of client/c/README.md leaves to its reader. */
#include <lpdeform.h>
#include <stdio.h>
#include <time.h>

static float vertices[22][3];
static int is_drawn;

static void draw(void) { is_drawn = vertices[20][1] == 1; }

/* Until the lifted tip was drawn, a minute at most; 60 frames a second. */
static int game_runs(void) {
  static int frame;
  const struct timespec pause = {0, 16666667};
  nanosleep(&pause, NULL);
  return !is_drawn && ++frame < 3600;
}

int main(void) {
  const uint32_t corners[6] = {0, 2, 3, 0, 3, 1}, first[2] = {0, 1}, last[2] = {20, 21};
  uint32_t indices[60];
  int k;
  lpdeform_error error = {.struct_size = sizeof error};
  lpdeform_connection connection = {.struct_size = sizeof connection};
  lpdeform_mesh mesh = {.struct_size = sizeof mesh};
  lpdeform_options options = {.struct_size = sizeof options};
  lpdeform_handle base = {.struct_size = sizeof base}, tip = {.struct_size = sizeof tip};
  lpdeform_motion motion = {.kind = LPDEFORM_RIGID};
  lpdeform_buffers buffers = {.struct_size = sizeof buffers};
  lpdeform_frame frame = {.struct_size = sizeof frame};
  lpdeform_client* client;
  lpdeform_session* session;

  for (k = 0; k < 22; ++k) {
    vertices[k][0] = k / 2;
    vertices[k][2] = -(k % 2);
  }
  for (k = 0; k < 60; ++k) indices[k] = 2 * (k / 6) + corners[k % 6];
  connection.address = "localhost:50051";
  mesh.vertex_count = 22;
  mesh.positions.data = vertices;
  mesh.positions.bytes = sizeof vertices;
  mesh.indices = indices;
  mesh.index_count = 60;
  base.name = "base";
  base.vertices = first;
  base.vertex_count = 2;
  tip.name = "tip";
  tip.vertices = last;
  tip.vertex_count = 2;
  motion.translation[1] = 1;
  buffers.positions.data = vertices;
  buffers.positions.bytes = sizeof vertices;
  if (lpdeform_connect(&connection, &client, &error) != LPDEFORM_OK) return 1;
  QUICK_START
  printf("%g\n", vertices[20][1]);
  lpdeform_close(session);
  lpdeform_disconnect(client);
  return 0;
}
