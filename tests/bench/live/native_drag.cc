// A live drag of the viewer's fine bar (10,124 vertices, p = 1.5) by the C++ client, for the table of `npm run drag`; and of
// bars of other sizes, for tests/bench/latency/run:
//   native_drag ADDRESS float32|quantized|compressed SECONDS [VERTICES P MOVES_A_SECOND FRAMES_A_SECOND]
// Moves the upper end every 16 ms, like the scripted user of that table, and takes frames as they come. Prints one line of
// JSON: milliseconds from each move to the frame that answers it, including moves that a newer one superseded.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "core/shapes/shapes.h"

namespace lpdeform::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Drag {
  int cells = 21, height = 110;
  double p = 1.5, moves_a_second = 62.5, frames_a_second = 60;  // frames: 0 for no limit
};
constexpr milliseconds kPatience{60'000};

Mesh bar(const Drag& drag) {
  const TriangleMesh box = box_surface(drag.cells, drag.cells, drag.height);
  Mesh mesh;
  for (Eigen::Index k = 0; k < box.vertices.size(); ++k)
    mesh.vertices.push_back(box.vertices.data()[k] / drag.cells);
  mesh.faces.assign(box.faces.data(), box.faces.data() + box.faces.size());
  return mesh;
}

Update ends(const Mesh& mesh, const Drag& drag) {
  Handle base, top;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const double z = mesh.vertices[3 * v + 2];
    if (z < 0.01) base.vertices.push_back(static_cast<std::uint32_t>(v));
    if (z > 1.0 * drag.height / drag.cells - 0.01) top.vertices.push_back(static_cast<std::uint32_t>(v));
  }
  Update update;
  update.handles.emplace("base", base);
  update.handles.emplace("top", top);
  update.settings.p = drag.p;
  return update;
}

struct Tally {
  std::mutex mutex;
  std::deque<std::pair<std::uint64_t, Clock::time_point>> waiting;
  std::vector<double> latencies;
  int frames = 0;
};

void take_frames(Session& session, Tally& tally, std::uint64_t& last_input) {
  while (true) {
    const absl::StatusOr<Frame> frame = session.next_frame(kPatience);
    if (!frame.ok()) return;
    const Clock::time_point now = Clock::now();
    const std::lock_guard lock(tally.mutex);
    ++tally.frames;
    while (!tally.waiting.empty() && tally.waiting.front().first <= frame->input_seq) {
      tally.latencies.push_back(
          std::chrono::duration<double, std::milli>(now - tally.waiting.front().second).count());
      tally.waiting.pop_front();
    }
    if (last_input != 0 && frame->input_seq >= last_input && frame->is_final) return;
  }
}

int run(const std::string& address, Encoding encoding, double seconds, const Drag& drag) {
  const Mesh mesh = bar(drag);
  absl::StatusOr<Client> client = Client::connect(address);
  if (!client.ok()) return std::fprintf(stderr, "%s\n", client.status().ToString().c_str()), 1;
  OpenOptions options;
  options.encoding = options.lowest_encoding = encoding;
  options.max_frames_per_second = drag.frames_a_second;
  absl::StatusOr<Session> session = client->open(mesh, options);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.status().ToString().c_str()), 1;
  (void)session->update(ends(mesh, drag));
  if (!session->settle(kPatience).ok()) return std::fprintf(stderr, "nothing settles\n"), 1;

  Tally tally;
  std::uint64_t last_input = 0;
  std::jthread reading([&] { take_frames(*session, tally, last_input); });
  const Clock::time_point begin = Clock::now();
  int moves = 0;
  for (double now = 0; now < seconds; now = std::chrono::duration<double>(Clock::now() - begin).count()) {
    const double aside = std::sin(now / 0.9), down = 0.36 * (1 - std::cos(now / 0.7));
    {
      const std::lock_guard lock(tally.mutex);
      const Clock::time_point moved = Clock::now();
      tally.waiting.emplace_back(session->move("top", RigidMotion{.translation = {aside, 0, -down}}).value(),
                                 moved);
    }
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(++moves / drag.moves_a_second)));
  }
  {
    const std::lock_guard lock(tally.mutex);
    last_input = session->move("top", RigidMotion{}).value();
  }
  reading.join();
  std::vector<double>& all = tally.latencies;
  std::ranges::sort(all);
  const auto at = [&](double share) {
    return all.empty() ? NAN : all[static_cast<std::size_t>(share * static_cast<double>(all.size() - 1))];
  };
  std::printf(
      "{\"vertices\": %zu, \"inputs\": %zu, \"framesPerSecond\": %.1f, \"p50\": %.2f, \"p99\": %.2f, "
      "\"mean\": "
      "%.2f}\n",
      mesh.vertex_count(), all.size(), tally.frames / seconds, at(0.5), at(0.99),
      std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size()));
  return 0;
}

}  // namespace
}  // namespace lpdeform::client

int main(int count, char** arguments) {
  using lpdeform::client::Encoding;
  const std::map<std::string, Encoding> encodings = {{"float32", Encoding::kRaw},
                                                     {"quantized", Encoding::kQuantized},
                                                     {"compressed", Encoding::kCompressed}};
  const bool is_sized = count == 8;
  if ((count != 4 && !is_sized) || !encodings.contains(arguments[2])) {
    std::fprintf(stderr,
                 "native_drag ADDRESS float32|quantized|compressed SECONDS [VERTICES P MOVES_A_SECOND "
                 "FRAMES_A_SECOND]\n");
    return 2;
  }
  lpdeform::client::Drag drag;
  if (is_sized) {
    drag.cells = std::max(
        1, static_cast<int>(std::sqrt(std::stod(arguments[4]) / 22)));  // 1 x 1 x 5 cells: 22 c^2 vertices
    drag.height = 5 * drag.cells;
    drag.p = std::stod(arguments[5]);
    drag.moves_a_second = std::stod(arguments[6]);
    drag.frames_a_second = std::stod(arguments[7]);
  }
  return lpdeform::client::run(arguments[1], encodings.at(arguments[2]), std::stod(arguments[3]), drag);
}
