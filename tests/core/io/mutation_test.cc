#include <random>

#include "core/mesh/report.h"
#include "core/shapes/shapes.h"
#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

constexpr std::string_view kAsciiPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty list uint float extra\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0.5\n0 1 1e-3\n3 0 1 2 2 0.5 0.25\n4 0 1 2 3 0\n";
constexpr std::string_view kAsciiStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 "
    "0\nendloop\nendfacet\nendsolid\n";
constexpr std::string_view kObj =
    "v 0 0 0\nv 1 0 \\\n0\nv 1 1 0 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3//1 -1\n# end\nf -4 -3 "
    "-2\n";

std::string binary_stl() {
  std::string bytes(80, ' ');
  bytes += std::string("\2\0\0\0", 4);
  for (int k = 0; k < 100; ++k) bytes += static_cast<char>(37 * k);
  return bytes;
}

std::string written(const char* name) {
  const ScratchFolder folder;
  const MeshFile file{box_surface(1, 1, 2), ""};
  EXPECT_TRUE(write_mesh(folder / name, file, file.mesh.vertices, Field::Ones(12)).ok());
  return file_bytes(folder / name);
}

/// A few bytes changed, a piece cut out, or a piece put in twice.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
  };
  const std::size_t at = below(bytes.size()),
                    length = 1 + below(std::min<std::size_t>(20, bytes.size() - at));
  switch (below(4)) {
    case 0:
      bytes[at] = static_cast<char>(below(256));
      break;
    case 1:
      bytes[at] = "0123456789-.e/ \n"[below(16)];
      break;
    case 2:
      bytes.erase(at, length);
      break;
    default:
      bytes.insert(below(bytes.size()), bytes.substr(at, length));
  }
  return bytes;
}

TEST(Mutation, DamagedFilesAreRefusedOrReadAndNeverMore) {
  const std::vector<std::pair<std::string, MeshFormat>> sources{
      {written("a.off"), MeshFormat::kOff}, {std::string(kObj), MeshFormat::kObj},
      {written("a.ply"), MeshFormat::kPly}, {std::string(kAsciiPly), MeshFormat::kPly},
      {binary_stl(), MeshFormat::kStl},     {std::string(kAsciiStl), MeshFormat::kStl}};
  std::mt19937 random(20260101);
  for (const auto& [source, format] : sources) {
    int refused = 0, read = 0;
    for (int round = 0; round < 3000; ++round) {
      std::string bytes = mutated(source, random);
      if (round % 2 == 1) bytes = mutated(bytes, random);
      const absl::StatusOr<MeshFile> file = parse_mesh(bytes, format);
      ++(file.ok() ? read : refused);
      if (!file.ok()) {
        EXPECT_EQ(fault_of(file.status()).reason, "MESH_SYNTAX");
        continue;
      }
      const MeshReport report = check_mesh(file->mesh);
      EXPECT_EQ(report.vertices, file->mesh.vertices.rows());
      if (format == MeshFormat::kObj) {
        const TriangleMesh back = parsed(obj_text(*file, file->mesh.vertices), MeshFormat::kObj);
        EXPECT_TRUE(same_faces(back.faces, file->mesh.faces));
      }
    }
    EXPECT_GT(refused, 100);
    EXPECT_GT(read, 100);
  }
}

}  // namespace
}  // namespace lpdeform
