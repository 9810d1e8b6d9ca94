/* Lifts one end of a strip of triangles over a running server: consumer ADDRESS. Prints how high the end is, in centimetres. */
#include <lpdeform.h>
#include <stdio.h>

enum { CELLS = 10, VERTICES = 2 * CELLS + 2, INDICES = 6 * CELLS };

static lpdeform_error error = {sizeof error};

static int failed(lpdeform_code code) {
  if (code != LPDEFORM_OK) fprintf(stderr, "%s (%s)\n", error.message, error.reason);
  return code != LPDEFORM_OK;
}

int main(int argc, char** argv) {
  float vertices[VERTICES][3] = {{0}};
  uint32_t indices[INDICES];
  lpdeform_connection connection = {sizeof connection};
  lpdeform_mesh mesh = {sizeof mesh};
  lpdeform_options options = {sizeof options};
  lpdeform_handle base = {sizeof base}, tip = {sizeof tip};
  lpdeform_buffers buffers = {sizeof buffers};
  const uint32_t first[] = {0, 1}, last[] = {VERTICES - 2, VERTICES - 1};
  lpdeform_client* client;
  lpdeform_session* session;
  int k;

  if (argc != 2 || lpdeform_abi() != LPDEFORM_ABI) return 2;
  for (k = 0; k < VERTICES; ++k) {
    vertices[k][0] = 100.0F * (float)(k / 2);
    vertices[k][1] = 100.0F * (float)(k % 2);
  }
  for (k = 0; k < CELLS; ++k) {
    const uint32_t a = 2 * (uint32_t)k, two[6] = {a, a + 2, a + 3, a, a + 3, a + 1};
    int corner;
    for (corner = 0; corner < 6; ++corner) indices[6 * k + corner] = two[corner];
  }

  connection.address = argv[1];
  if (failed(lpdeform_connect(&connection, &client, &error))) return 1;
  mesh.vertex_count = VERTICES;
  mesh.positions.data = vertices;
  mesh.positions.bytes = sizeof vertices;
  mesh.indices = indices;
  mesh.index_count = INDICES;
  options.handedness = LPDEFORM_LEFT_HANDED; /* Unreal's */
  options.up = LPDEFORM_Z_UP;
  options.units_per_metre = 100;
  if (failed(lpdeform_open(client, &mesh, &options, &session, &error))) return 1;

  base.name = "base";
  base.vertices = first;
  base.vertex_count = 2;
  tip.name = "tip";
  tip.vertices = last;
  tip.vertex_count = 2;
  tip.motion.kind = LPDEFORM_RIGID;
  tip.motion.translation[2] = 400;
  if (failed(lpdeform_set_handle(session, &base, NULL, &error))) return 1;
  if (failed(lpdeform_set_handle(session, &tip, NULL, &error))) return 1;
  buffers.positions.data = vertices;
  buffers.positions.bytes = sizeof vertices;
  if (failed(lpdeform_settle(session, 60, &buffers, NULL, &error))) return 1;
  printf("%g\n", vertices[VERTICES - 1][2]);
  lpdeform_close(session);
  lpdeform_disconnect(client);
  return 0;
}
