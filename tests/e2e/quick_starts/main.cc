// The mesh and the end of the quick start of client/README.md.
#include <lpdeform/client.h>

#include <cstdint>
#include <iostream>
#include <vector>

int main() {
  lpdeform::client::Mesh mesh;
  for (int k = 0; k <= 10; ++k) mesh.vertices.insert(mesh.vertices.end(), {double(k), 0, 0, double(k), 1, 0});
  for (std::uint32_t k = 0; k < 20; k += 2) {
    for (const std::uint32_t corner : {0U, 2U, 3U, 0U, 3U, 1U}) mesh.faces.push_back(k + corner);
  }
  const std::vector<std::uint32_t> base{0, 1}, tip{20, 21};
  QUICK_START
  std::cout << frame->positions[3 * 20 + 2] << "\n";
}
