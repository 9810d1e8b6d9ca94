// What calls of the C interface cost the calling thread, such as a game's, while a mesh of 10,201 vertices is dragged: 60
// frames per second, 10 s each, with the server in this process. "On the clock" is how long a game waits, including the time
// that other threads of a busy machine take. "Computing" is the thread's own time.

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "client/c/lpdeform.h"
#include "server/server.h"

namespace {

constexpr std::uint32_t kSide = 101, kVertices = kSide * kSide;
constexpr int kFrames = 600;

/// An interleaved vertex as engines have them; each attribute in a wide and in a narrow form.
struct Vertex {
  std::array<float, 3> position, normal;
  std::array<std::uint16_t, 4> narrow_position;
  std::array<std::int16_t, 4> narrow_normal;
  std::array<std::uint8_t, 4> colour;
};

struct Costs {
  std::vector<double> on_the_clock, computing;  // milliseconds
};

double thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <typename Call>
lpdeform_code timed(Costs& with_frame, Costs& without, Call call) {
  const auto start = std::chrono::steady_clock::now();
  const double computed = thread_milliseconds();
  const lpdeform_code code = call();
  Costs& costs = code == LPDEFORM_NO_FRAME ? without : with_frame;
  costs.computing.push_back(thread_milliseconds() - computed);
  costs.on_the_clock.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  return code;
}

double quantile(std::vector<double>& numbers, double which) {
  std::ranges::sort(numbers);
  return numbers[static_cast<std::size_t>(which * static_cast<double>(numbers.size() - 1))];
}

void tell(const char* name, Costs& costs) {
  if (costs.computing.empty()) return;
  std::printf("| %s | %zu | %.3f | %.3f | %.3f | %.3f |\n", name, costs.computing.size(),
              quantile(costs.on_the_clock, 0.5), quantile(costs.on_the_clock, 0.99),
              quantile(costs.computing, 0.5), quantile(costs.computing, 0.99));
}

lpdeform_error error = {
    .struct_size = sizeof error, .code = 0, .reason = {}, .element = {}, .limit = {}, .message = {}};

void check(lpdeform_code code) {
  if (code == LPDEFORM_OK || code == LPDEFORM_NO_FRAME) return;
  std::fprintf(stderr, "%s (%s)\n", error.message, error.reason);
  std::exit(1);
}

lpdeform_session* open(lpdeform_client* client, std::vector<Vertex>& vertices, lpdeform_encoding encoding) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < kVertices; ++i) {
    vertices[i].position = {0.02F * static_cast<float>(i % kSide), 0, -0.02F * static_cast<float>(i / kSide)};
    if (i % kSide == kSide - 1 || i / kSide == kSide - 1) continue;
    for (const std::uint32_t step : {0U, 1U, kSide + 1, 0U, kSide + 1, kSide}) indices.push_back(i + step);
  }
  lpdeform_mesh mesh{};
  mesh.struct_size = sizeof mesh;
  mesh.vertex_count = kVertices;
  mesh.positions = {
      vertices.data(), kVertices * sizeof(Vertex), offsetof(Vertex, position), sizeof(Vertex), 0, 0};
  mesh.indices = indices.data();
  mesh.index_count = static_cast<std::uint32_t>(indices.size());
  lpdeform_options options{};
  options.struct_size = sizeof options;
  options.with_normals = 1;
  options.encoding = encoding;
  lpdeform_session* session = nullptr;
  check(lpdeform_open(client, &mesh, &options, &session, &error));
  for (const bool is_tip : {false, true}) {
    std::vector<std::uint32_t> edge(kSide);
    for (std::uint32_t k = 0; k < kSide; ++k) edge[k] = is_tip ? kVertices - kSide + k : k;
    lpdeform_handle handle{};
    handle.struct_size = sizeof handle;
    handle.name = is_tip ? "tip" : "base";
    handle.vertices = edge.data();
    handle.vertex_count = kSide;
    check(lpdeform_set_handle(session, &handle, nullptr, &error));
  }
  return session;
}

lpdeform_buffers buffers_of(std::vector<Vertex>& vertices, bool is_narrow) {
  const auto at = [&](std::size_t offset, lpdeform_format format) {
    return lpdeform_target{vertices.data(),
                           kVertices * sizeof(Vertex),
                           static_cast<std::uint32_t>(offset),
                           sizeof(Vertex),
                           format,
                           0};
  };
  lpdeform_buffers out{};
  out.struct_size = sizeof out;
  out.positions = is_narrow ? at(offsetof(Vertex, narrow_position), LPDEFORM_UNORM16)
                            : at(offsetof(Vertex, position), LPDEFORM_FLOAT32);
  out.normals = is_narrow ? at(offsetof(Vertex, narrow_normal), LPDEFORM_SNORM16)
                          : at(offsetof(Vertex, normal), LPDEFORM_FLOAT32);
  out.colours = at(offsetof(Vertex, colour), LPDEFORM_RGBA8);
  return out;
}

void drag(lpdeform_client* client, const char* name, lpdeform_encoding encoding, bool is_narrow) {
  std::vector<Vertex> vertices(kVertices);
  lpdeform_session* const session = open(client, vertices, encoding);
  const lpdeform_buffers buffers = buffers_of(vertices, is_narrow);
  check(lpdeform_settle(session, 60, &buffers, nullptr, &error));
  Costs moves, polls, misses;
  const auto start = std::chrono::steady_clock::now();
  for (int frame = 0; frame < kFrames; ++frame) {
    lpdeform_motion motion{};
    motion.kind = LPDEFORM_RIGID;
    motion.translation[1] = 0.5 * std::sin(frame / 60.0);
    check(
        timed(moves, moves, [&] { return lpdeform_move_handle(session, "tip", &motion, nullptr, &error); }));
    check(timed(polls, misses, [&] { return lpdeform_poll(session, &buffers, nullptr, &error); }));
    std::this_thread::sleep_until(start + (frame + 1) * std::chrono::duration<double>(1.0 / 60));
  }
  lpdeform_close(session);
  tell((std::string(name) + ", move").c_str(), moves);
  tell((std::string(name) + ", poll with a frame").c_str(), polls);
  tell((std::string(name) + ", poll without").c_str(), misses);
}

}  // namespace

int main() {
  lpdeform::ServerOptions options;
  options.address = "127.0.0.1:0";
  options.threads = 1;
  const auto server = lpdeform::Server::start(options);
  if (!server.ok()) return 1;
  const std::string address = (*server)->address();
  lpdeform_connection connection{};
  connection.struct_size = sizeof connection;
  connection.address = address.c_str();
  lpdeform_client* client = nullptr;
  check(lpdeform_connect(&connection, &client, &error));
  std::printf(
      "| %u vertices, with normals and colours | calls | on the clock: p50 ms | p99 ms | computing: p50 ms | "
      "p99 ms |\n",
      kVertices);
  std::printf("|:--|--:|--:|--:|--:|--:|\n");
  drag(client, "float32", LPDEFORM_ENCODING_RAW, false);
  drag(client, "16-bit", LPDEFORM_ENCODING_QUANTIZED, true);
  lpdeform_disconnect(client);
  return 0;
}
