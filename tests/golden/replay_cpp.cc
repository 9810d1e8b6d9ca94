// How the C++ client reads the golden recordings: see replay.py.   replay_cpp ADDRESS NUMBER_OF_ERRORS

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "client/cpp/client.h"

using namespace lpdeform::client;

namespace {

constexpr std::chrono::seconds kPatience{30};

Mesh strip() {
  Mesh mesh;
  for (int k = 0; k <= 10; ++k) mesh.vertices.insert(mesh.vertices.end(), {double(k), 0, 0, double(k), 1, 0});
  for (std::uint32_t k = 0; k < 20; k += 2) {
    for (const std::uint32_t corner : {0U, 2U, 3U, 0U, 3U, 1U}) mesh.faces.push_back(k + corner);
  }
  return mesh;
}

void tell(const char* name, const char* what, const std::vector<double>& numbers) {
  std::printf("%s %s:", name, what);
  for (const double number : numbers)
    std::printf(" %08x", std::bit_cast<std::uint32_t>(static_cast<float>(number)));
  std::printf("\n");
}

void tell(const char* where, const absl::Status& status) {
  const lpdeform::Fault fault = lpdeform::fault_of(status);
  std::printf("%s %d %s | %s | %s | %s\n", where, static_cast<int>(status.code()), fault.reason.c_str(),
              fault.element.c_str(), fault.limit.c_str(), std::string(status.message()).c_str());
}

void tell_frame(const char* name, const Frame& frame) {
  std::printf("%s: result %d, %s, iteration %u, energy %016lx\n", name, frame.is_final,
              stop_reason_name(frame.stop_reason).c_str(), frame.iteration,
              std::bit_cast<std::uint64_t>(frame.energy));
  tell(name, "positions", frame.positions);
  tell(name, "distortion", frame.distortion);
  tell(name, "normals", frame.normals);
}

/// With both handles.
Session open(Client& client, Encoding encoding, bool double_precision) {
  OpenOptions options;
  options.encoding = encoding;
  options.double_precision = double_precision;
  options.with_normals = true;
  Session session = client.open(strip(), options).value();
  Update update;
  update.handles["base"] = Handle{.vertices = {0, 1}};
  update.handles["tip"] = Handle{.vertices = {20, 21}, .motion = RigidMotion{.translation = {-4, 0, 3}}};
  session.update(update).value();
  return session;
}

void tell_frame(Client& client, const char* name, Encoding encoding, bool double_precision) {
  Session session = open(client, encoding, double_precision);
  tell_frame(name, session.settle(kPatience).value());
  const Notice notice = session.notice().value();
  std::printf("%s notice: %s, %s\n", name,
              notice.reason == Notice::Reason::kOverloaded ? "overloaded" : "otherwise", notice.text.c_str());
}

/// What settle() says that may not wait.
void settle_again(Session& session) {
  const absl::StatusOr<Frame> frame = session.settle(std::chrono::seconds(0));
  if (frame.ok())
    std::printf("settled again: %s, iteration %u\n", stop_reason_name(frame->stop_reason).c_str(),
                frame->iteration);
  else
    std::printf("settled again: %s\n", lpdeform::fault_of(frame.status()).reason.c_str());
}

void tell_calls(Client& client) {
  Session session = open(client, Encoding::kRaw, false);
  session.settle(kPatience).value();
  settle_again(session);
  session.move("tip", RigidMotion{.translation = {0, 0, 1}}).value();
  settle_again(session);
  session.undo().value();
  tell_frame("undo", session.settle(kPatience).value());
  settle_again(session);
  const std::string file = session.snapshot().value();
  std::printf("snapshot: %zu bytes\n", file.size());
  std::printf("restored: %s\n", client.open_snapshot(file).value().name().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const int errors = std::atoi(argv[2]);
  Client client = Client::connect(argv[1]).value();
  tell_frame(client, "float64", Encoding::kRaw, true);
  tell_frame(client, "float32", Encoding::kRaw, false);
  tell_frame(client, "quantized", Encoding::kQuantized, false);
  tell_frame(client, "compressed", Encoding::kCompressed, false);
  tell_calls(client);
  for (int k = 0; k < errors; ++k) {
    Mesh mesh{.vertices = std::vector<double>(3 * (1000 + k)), .faces = {0, 1, 2}};
    tell("call", client.open(std::move(mesh)).status());
  }
  Session session = client.open(strip()).value();
  for (int k = 0; k < errors; ++k) {
    session.move(std::to_string(k), Fixed{}).value();
    tell("fault", session.next_frame(kPatience).status());
  }
  return 0;
}
