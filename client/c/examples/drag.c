/* The loop of a game, without a game: a sheet is held at one edge, and its opposite edge is dragged for 10 seconds at
 * 60 frames per second.
 *
 *   drag ADDRESS [CELLS [FRAMES]]     CELLS per side, default 100: 10,201 vertices
 *
 * Prints each change of the session's state, then how long frames took, and the share of the library's calls. Continues
 * through restarts of the server. C99 and POSIX clocks. */
#define _POSIX_C_SOURCE 200809L

#include <lpdeform.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Vertices as an engine stores them: interleaved, ready to draw. */
typedef struct vertex {
  float position[3];
  float normal[3];
  float texture[2];
  unsigned char colour[4];
} vertex;

typedef struct sheet {
  uint32_t cells, vertex_count, index_count;
  vertex* vertices;
  uint32_t* indices;
  uint32_t* fixed_edge;
  uint32_t* moving_edge;
} sheet;

static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void wait_until(double time) {
  const double left = time - seconds();
  if (left <= 0) return;
  struct timespec pause;
  pause.tv_sec = (time_t)left;
  pause.tv_nsec = (long)(1e9 * (left - (double)pause.tv_sec));
  nanosleep(&pause, NULL);
}

static sheet make_sheet(uint32_t cells) {
  const uint32_t side = cells + 1;
  sheet made = {cells, side * side, 6 * cells * cells, NULL, NULL, NULL, NULL};
  made.vertices = calloc(made.vertex_count, sizeof *made.vertices);
  made.indices = calloc(made.index_count, sizeof *made.indices);
  made.fixed_edge = calloc(side, sizeof *made.fixed_edge);
  made.moving_edge = calloc(side, sizeof *made.moving_edge);
  if (!made.vertices || !made.indices || !made.fixed_edge || !made.moving_edge) exit(1);
  for (uint32_t i = 0; i < made.vertex_count; ++i) {
    vertex* const at = &made.vertices[i];
    at->texture[0] = (float)(i % side) / (float)cells;
    at->texture[1] = (float)(i / side) / (float)cells;
    at->position[0] = 2 * at->texture[0];
    at->position[2] = -2 * at->texture[1];
    at->normal[1] = 1;
  }
  uint32_t* corner = made.indices;
  for (uint32_t row = 0; row < cells; ++row) {
    for (uint32_t column = 0; column < cells; ++column) {
      const uint32_t a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      const uint32_t two[6] = {a, b, d, a, d, c};
      memcpy(corner, two, sizeof two);
      corner += 6;
    }
  }
  for (uint32_t k = 0; k < side; ++k) {
    made.fixed_edge[k] = k;
    made.moving_edge[k] = made.vertex_count - side + k;
  }
  return made;
}

static lpdeform_error error = {.struct_size = sizeof(lpdeform_error)};

static void check(lpdeform_code code, const char* what) {
  if (code == LPDEFORM_OK) return;
  fprintf(stderr, "%s: %s (%s)\n", what, error.message, error.reason);
  exit(1);
}

static lpdeform_session* open_sheet(lpdeform_client* client, const sheet* sheet) {
  const size_t bytes = sheet->vertex_count * sizeof(vertex);
  lpdeform_mesh mesh = {.struct_size = sizeof mesh};
  mesh.vertex_count = sheet->vertex_count;
  mesh.positions =
      (lpdeform_source){sheet->vertices, bytes, offsetof(vertex, position), sizeof(vertex), 0, 0};
  mesh.normals = (lpdeform_source){sheet->vertices, bytes, offsetof(vertex, normal), sizeof(vertex), 0, 0};
  mesh.indices = sheet->indices;
  mesh.index_count = sheet->index_count;
  lpdeform_options options = {.struct_size = sizeof options};
  options.with_normals = 1;
  lpdeform_session* session = NULL;
  check(lpdeform_open(client, &mesh, &options, &session, &error), "open");
  return session;
}

static void hold(lpdeform_session* session, const char* name, const uint32_t* vertices, uint32_t count) {
  lpdeform_handle handle = {.struct_size = sizeof handle};
  handle.name = name;
  handle.vertices = vertices;
  handle.vertex_count = count;
  check(lpdeform_set_handle(session, &handle, NULL, &error), name);
}

/* Lifts the edge and rotates it about the middle of the sheet. */
static lpdeform_motion pose(double t) {
  lpdeform_motion motion = {LPDEFORM_RIGID, 0, {0}, {0}, {0}, NULL};
  const double angle = 0.8 * sin(2 * t);
  motion.rotation[2] = sin(angle / 2);
  motion.rotation[3] = cos(angle / 2);
  motion.center[0] = 1;
  motion.translation[1] = 0.7 + 0.3 * sin(t);
  motion.translation[2] = 0.3;
  return motion;
}

static lpdeform_buffers buffers_of(const sheet* sheet) {
  const size_t bytes = sheet->vertex_count * sizeof(vertex);
  lpdeform_buffers into = {.struct_size = sizeof into};
  into.positions =
      (lpdeform_target){sheet->vertices, bytes, offsetof(vertex, position), sizeof(vertex), 0, 0};
  into.normals = (lpdeform_target){sheet->vertices, bytes, offsetof(vertex, normal), sizeof(vertex), 0, 0};
  into.colours =
      (lpdeform_target){sheet->vertices, bytes, offsetof(vertex, colour), sizeof(vertex), LPDEFORM_RGBA8, 0};
  return into;
}

static void tell_state(lpdeform_session* session, int frame) {
  static const char* const names[] = {"connecting", "live", "reconnecting", "refused"};
  static lpdeform_state last = -1;
  const lpdeform_state state = lpdeform_session_state(session, &error);
  if (state == last) return;
  last = state;
  printf("frame %d: %s%s%s\n", frame, names[state], error.code == LPDEFORM_OK ? "" : ": ",
         error.code == LPDEFORM_OK ? "" : error.message);
  fflush(stdout);
  if (state == LPDEFORM_STATE_REFUSED) exit(1);
}

static int by_size(const void* a, const void* b) {
  const double left = *(const double*)a, right = *(const double*)b;
  return (left > right) - (left < right);
}

static void tell_costs(const char* name, double* costs, int count) {
  if (count == 0) return;
  qsort(costs, (size_t)count, sizeof *costs, by_size);
  printf("%s: %d, p50 %.4f ms, p99 %.4f ms, most %.4f ms\n", name, count, 1e3 * costs[count / 2],
         1e3 * costs[count * 99 / 100], 1e3 * costs[count - 1]);
}

static void drag(lpdeform_session* session, const sheet* sheet, int frames) {
  const lpdeform_buffers into = buffers_of(sheet);
  double* const moves = calloc((size_t)frames, sizeof *moves);
  double* const polls = calloc((size_t)frames, sizeof *polls);
  double* const misses = calloc((size_t)frames, sizeof *misses);
  double* const pictures = calloc((size_t)frames, sizeof *pictures);
  if (!moves || !polls || !misses || !pictures) exit(1);
  int drawn = 0, missed = 0;
  const double start = seconds();
  for (int frame = 0; frame < frames; ++frame) {
    const lpdeform_motion motion = pose(frame / 60.0);
    const double before = seconds();
    check(lpdeform_move_handle(session, "edge", &motion, NULL, &error), "move");
    const double between = seconds();
    const lpdeform_code code = lpdeform_poll(session, &into, NULL, &error);
    const double after = seconds();
    moves[frame] = between - before;
    if (code == LPDEFORM_OK) {
      polls[drawn++] = after - between; /* here an engine would draw the vertices */
    } else {
      misses[missed++] = after - between;
      if (code != LPDEFORM_NO_FRAME) printf("frame %d: %s (%s)\n", frame, error.message, error.reason);
    }
    tell_state(session, frame);
    wait_until(start + (frame + 1) / 60.0);
    pictures[frame] = seconds() - before;
  }
  tell_costs("frames", pictures, frames);
  tell_costs("moves", moves, frames);
  tell_costs("polls with a frame", polls, drawn);
  tell_costs("polls without", misses, missed);
  free(moves);
  free(polls);
  free(misses);
  free(pictures);
}

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr, "drag ADDRESS [CELLS [FRAMES]]\n");
    return 2;
  }
  const sheet sheet = make_sheet(argc > 2 ? (uint32_t)atoi(argv[2]) : 100);
  lpdeform_connection connection = {.struct_size = sizeof connection};
  connection.address = argv[1];
  lpdeform_client* client = NULL;
  check(lpdeform_connect(&connection, &client, &error), "connect");
  lpdeform_session* const session = open_sheet(client, &sheet);
  hold(session, "base", sheet.fixed_edge, sheet.cells + 1);
  hold(session, "edge", sheet.moving_edge, sheet.cells + 1);

  drag(session, &sheet, argc > 3 ? atoi(argv[3]) : 600);

  /* The last pose, solved to the end. */
  const lpdeform_buffers into = buffers_of(&sheet);
  lpdeform_frame frame = {.struct_size = sizeof frame};
  lpdeform_motion motion = pose(0);
  check(lpdeform_move_handle(session, "edge", &motion, NULL, &error), "move");
  check(lpdeform_settle(session, 60, &into, &frame, &error), "settle");
  const vertex* const corner = &sheet.vertices[sheet.moving_edge[0]];
  printf("settled: energy %.6g, the edge is at %.4f %.4f %.4f\n", frame.energy, corner->position[0],
         corner->position[1], corner->position[2]);
  lpdeform_close(session);
  lpdeform_disconnect(client);
  free(sheet.vertices);
  free(sheet.indices);
  free(sheet.fixed_edge);
  free(sheet.moving_edge);
  return 0;
}
