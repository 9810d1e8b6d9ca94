// Bends a strip of triangles over a running server: consumer ADDRESS. Prints the height of the end that was
// moved.

#include <lpdeform/client.h>

#include <cstdint>
#include <iostream>

using namespace lpdeform::client;

namespace {

Mesh strip(std::uint32_t cells) {
  Mesh mesh;
  for (std::uint32_t k = 0; k <= cells; ++k) {
    mesh.vertices.insert(mesh.vertices.end(), {double(k), 0, 0, double(k), 1, 0});
  }
  for (std::uint32_t k = 0; k < cells; ++k) {
    const std::uint32_t corner = 2 * k;
    mesh.faces.insert(mesh.faces.end(), {corner, corner + 2, corner + 3, corner, corner + 3, corner + 1});
  }
  return mesh;
}

int fail(const absl::Status& status) {
  std::cerr << status << "\n";
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  auto client = Client::connect(argv[1]);
  if (!client.ok()) return fail(client.status());
  auto session = client->open(strip(10));
  if (!session.ok()) return fail(session.status());

  session->set_handle("base", {.vertices = {0, 1}}).IgnoreError();
  session->set_handle("tip", {.vertices = {20, 21}, .motion = RigidMotion{.translation = {0, 0, 4}}})
      .IgnoreError();
  const auto frame = session->settle(std::chrono::seconds(30));
  if (!frame.ok()) return fail(frame.status());
  std::cout << frame->positions[3 * 20 + 2] << "\n";
  return 0;
}
