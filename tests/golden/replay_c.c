/* How the C interface reads the golden recordings: see replay.py.   replay_c ADDRESS NUMBER_OF_ERRORS */
#define _POSIX_C_SOURCE 200809L

#include <inttypes.h>
#include <lpdeform.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { VERTICES = 22, INDICES = 60 };

static lpdeform_error error = {.struct_size = sizeof(lpdeform_error)};
static float strip[VERTICES][3];
static uint32_t indices[INDICES];
static const double patience_seconds = 30;

static void check(lpdeform_code code) {
  if (code == LPDEFORM_OK) return;
  fprintf(stderr, "%s (%s)\n", error.message, error.reason);
  exit(1);
}

static void make_strip(void) {
  static const uint32_t corners[6] = {0, 2, 3, 0, 3, 1};
  for (uint32_t i = 0; i < VERTICES; ++i) {
    strip[i][0] = (float)(i / 2);
    strip[i][1] = (float)(i % 2);
  }
  for (uint32_t k = 0; k < INDICES; ++k) indices[k] = 2 * (k / 6) + corners[k % 6];
}

static lpdeform_session* open_strip(lpdeform_client* client, lpdeform_encoding encoding,
                                    uint32_t double_precision) {
  lpdeform_mesh mesh = {sizeof mesh};
  lpdeform_options options = {sizeof options};
  lpdeform_session* session = NULL;
  mesh.vertex_count = VERTICES;
  mesh.positions = (lpdeform_source){strip, sizeof strip, 0, 0, LPDEFORM_FLOAT32, 0};
  mesh.indices = indices;
  mesh.index_count = INDICES;
  options.encoding = encoding;
  options.double_precision = double_precision;
  options.with_normals = 1;
  check(lpdeform_open(client, &mesh, &options, &session, &error));
  return session;
}

static void hold(lpdeform_session* session) {
  const uint32_t first[2] = {0, 1}, last[2] = {20, 21};
  lpdeform_handle handles[2] = {{sizeof *handles}, {sizeof *handles}};
  lpdeform_update update = {sizeof update};
  handles[0].name = "base";
  handles[0].vertices = first;
  handles[0].vertex_count = 2;
  handles[1].name = "tip";
  handles[1].vertices = last;
  handles[1].vertex_count = 2;
  handles[1].motion.kind = LPDEFORM_RIGID;
  handles[1].motion.translation[0] = -4;
  handles[1].motion.translation[2] = 3;
  update.sets = handles;
  update.set_count = 2;
  check(lpdeform_send(session, &update, NULL, &error));
}

static void tell(const char* name, const char* what, const float* numbers, int count) {
  printf("%s %s:", name, what);
  for (int k = 0; k < count; ++k) {
    uint32_t bits;
    memcpy(&bits, &numbers[k], sizeof bits);
    printf(" %08" PRIx32, bits);
  }
  printf("\n");
}

static void tell_error(const char* where) {
  printf("%s %d %s | %s | %s | %s\n", where, (int)error.code, error.reason, error.element, error.limit,
         error.message);
}

static void tell_result(const char* name, lpdeform_session* session) {
  float positions[VERTICES][3], normals[VERTICES][3], distortion[VERTICES];
  lpdeform_buffers into = {sizeof into};
  lpdeform_frame frame = {sizeof frame};
  uint64_t energy;
  into.positions = (lpdeform_target){positions, sizeof positions, 0, 0, LPDEFORM_FLOAT32, 0};
  into.normals = (lpdeform_target){normals, sizeof normals, 0, 0, LPDEFORM_FLOAT32, 0};
  into.distortion = (lpdeform_target){distortion, sizeof distortion, 0, 0, LPDEFORM_FLOAT32, 0};
  check(lpdeform_settle(session, patience_seconds, &into, &frame, &error));
  memcpy(&energy, &frame.energy, sizeof energy);
  printf("%s: result %u, %s, iteration %u, energy %016" PRIx64 "\n", name, (unsigned)frame.is_final,
         frame.stop_reason == LPDEFORM_CONVERGED ? "converged" : "otherwise", (unsigned)frame.iteration,
         energy);
  tell(name, "positions", &positions[0][0], 3 * VERTICES);
  tell(name, "distortion", distortion, VERTICES);
  tell(name, "normals", &normals[0][0], 3 * VERTICES);
}

static void tell_frame(lpdeform_client* client, const char* name, lpdeform_encoding encoding,
                       uint32_t double_precision) {
  lpdeform_session* const session = open_strip(client, encoding, double_precision);
  char text[200];
  lpdeform_notice notice;
  hold(session);
  tell_result(name, session);
  notice = lpdeform_session_notice(session, text, sizeof text);
  printf("%s notice: %s, %s\n", name, notice == LPDEFORM_NOTICE_OVERLOADED ? "overloaded" : "otherwise", text);
  lpdeform_close(session);
}

static void tell_snapshot(lpdeform_client* client, lpdeform_session* session) {
  const struct timespec a_moment = {0, 1000000};
  lpdeform_snapshot* snapshot = NULL;
  lpdeform_session* restored = NULL;
  size_t bytes;
  const void* data;
  char name[64];
  check(lpdeform_take_snapshot(session, &snapshot, &error));
  data = lpdeform_snapshot_data(snapshot, &bytes);
  printf("snapshot: %zu bytes\n", bytes);
  check(lpdeform_restore(client, data, bytes, NULL, &restored, &error));
  lpdeform_free_snapshot(snapshot);
  while (lpdeform_session_name(restored, name, sizeof name, &error) != LPDEFORM_OK) {
    lpdeform_session_state(restored, &error);
    check(error.code);
    nanosleep(&a_moment, NULL);
  }
  printf("restored: %s\n", name);
  lpdeform_close(restored);
}

/* What a settle says that may not wait. */
static void settle_again(lpdeform_session* session) {
  const lpdeform_buffers none = {.struct_size = sizeof none};
  lpdeform_frame frame = {.struct_size = sizeof frame};
  if (lpdeform_settle(session, 0, &none, &frame, &error) == LPDEFORM_OK)
    printf("settled again: %s, iteration %u\n", frame.stop_reason == LPDEFORM_CONVERGED ? "converged" : "otherwise",
           (unsigned)frame.iteration);
  else
    printf("settled again: %s\n", error.reason);
}

static void tell_undo(lpdeform_client* client) {
  const lpdeform_motion elsewhere = {LPDEFORM_RIGID, 0, {0}, {0}, {0, 0, 1}, NULL};
  const lpdeform_buffers none = {.struct_size = sizeof none};
  lpdeform_session* const session = open_strip(client, LPDEFORM_ENCODING_RAW, 0);
  hold(session);
  check(lpdeform_settle(session, patience_seconds, &none, NULL, &error));
  settle_again(session);
  check(lpdeform_move_handle(session, "tip", &elsewhere, NULL, &error));
  settle_again(session);
  check(lpdeform_undo(session, NULL, &error));
  tell_result("undo", session);
  settle_again(session);
  tell_snapshot(client, session);
  lpdeform_close(session);
}

static void tell_call(lpdeform_client* client, uint32_t number) {
  static float nothing[2000][3];
  static const uint32_t face[3] = {0, 1, 2};
  const struct timespec a_moment = {0, 1000000};
  lpdeform_session* session = NULL;
  lpdeform_mesh mesh = {sizeof mesh};
  mesh.vertex_count = 1000 + number;
  mesh.positions = (lpdeform_source){nothing, sizeof nothing, 0, 0, LPDEFORM_FLOAT32, 0};
  mesh.indices = face;
  mesh.index_count = 3;
  check(lpdeform_open(client, &mesh, NULL, &session, &error));
  do {
    nanosleep(&a_moment, NULL);
    lpdeform_session_state(session, &error);
  } while (error.code == LPDEFORM_OK);
  tell_error("call");
  lpdeform_close(session);
}

int main(int argc, char** argv) {
  lpdeform_connection connection = {sizeof connection};
  lpdeform_client* client = NULL;
  lpdeform_session* session;
  const lpdeform_motion fixed = {LPDEFORM_FIXED, 0, {0}, {0}, {0}, NULL};
  const lpdeform_buffers none = {.struct_size = sizeof none};
  if (argc != 3) return 2;
  const int errors = atoi(argv[2]);
  make_strip();
  connection.address = argv[1];
  check(lpdeform_connect(&connection, &client, &error));
  tell_frame(client, "float64", LPDEFORM_ENCODING_RAW, 1);
  tell_frame(client, "float32", LPDEFORM_ENCODING_RAW, 0);
  tell_frame(client, "quantized", LPDEFORM_ENCODING_QUANTIZED, 0);
  tell_frame(client, "compressed", LPDEFORM_ENCODING_COMPRESSED, 0);
  tell_undo(client);
  for (int k = 0; k < errors; ++k) tell_call(client, (uint32_t)k);
  session = open_strip(client, LPDEFORM_ENCODING_RAW, 0);
  for (int k = 0; k < errors; ++k) {
    char name[16];
    snprintf(name, sizeof name, "%d", k);
    check(lpdeform_move_handle(session, name, &fixed, NULL, &error));
    lpdeform_settle(session, patience_seconds, &none, NULL, &error);
    tell_error("fault");
  }
  lpdeform_close(session);
  lpdeform_disconnect(client);
  return 0;
}
