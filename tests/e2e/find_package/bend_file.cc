// The client library beside the core, which reads and writes files: bend_file ADDRESS STRIP.glb BENT.glb writes a strip whose
// squares share no vertices, bends it over a running server, and prints the height of the end that was moved, as the written
// file has it.

#include <lpdeform/client.h>
#include <lpdeform/core.h>

#include <iostream>

using namespace lpdeform::client;

namespace {

lpdeform::core::Mesh strip(std::uint32_t cells) {
  lpdeform::core::Mesh mesh;
  for (std::uint32_t k = 0; k < cells; ++k) {
    const double x = k;
    mesh.vertices.insert(mesh.vertices.end(), {x, 0, 0, x + 1, 0, 0, x + 1, 1, 0, x, 1, 0});
    for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3}) mesh.faces.push_back(4 * k + corner);
  }
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  lpdeform::core::write_mesh(argv[2], strip(10)).value();
  const auto file = lpdeform::core::MeshFile::read(argv[2]).value();
  auto client = Client::connect(argv[1]);
  auto session = client->open({.vertices = file.mesh().vertices, .faces = file.mesh().faces},
                              {.weld = {.by_position = file.splits_vertices()}});
  session->set_handle("base", {.vertices = {0, 3}}).value();
  session->set_handle("tip", {.vertices = {37, 38}, .motion = RigidMotion{.translation = {0, 0, 4}}}).value();
  const auto bent = session->solve();
  file.write(argv[3], bent->positions).value();
  const auto again = lpdeform::core::read_mesh(argv[3]).value();
  std::cout << again.vertices[3 * 37 + 2] << "\n";
  // Copies along the seams stay together.
  for (std::uint32_t k = 0; k + 1 < 10; ++k) {
    if (again.vertices[3 * (4 * k + 1) + 2] != again.vertices[3 * (4 * k + 4) + 2]) return 1;
  }
  return 0;
}
