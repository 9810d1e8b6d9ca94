#include <limits>

#include "core/base/colour.h"
#include "core/io/byte_order.h"
#include "core/io/mesh_io.h"
#include "core/io/whole_file.h"
#include "core/shapes/shapes.h"
#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

/// Coordinates that are hard to write: denormal, huge, negative zero, without a short decimal.
TriangleMesh hard_to_write() {
  TriangleMesh mesh = sphere(1);
  mesh.vertices.row(0) << 4.9e-324, -1.7976931348623157e308, -0.0;
  mesh.vertices.row(1) << 0.1, 1.0 / 3, 1e23;
  return mesh;
}

TEST(WriteMesh, EveryFormatReadsBackToTheSameBits) {
  const ScratchFolder folder;
  const MeshFile file{hard_to_write(), ""};
  const Field distortion = Field::LinSpaced(file.mesh.vertices.rows(), 0, 1);
  for (const char* name : {"a.off", "a.obj", "a.ply", "B.PLY"}) {
    ASSERT_TRUE(write_mesh(folder / name, file, file.mesh.vertices, distortion).ok());
    const absl::StatusOr<MeshFile> back = read_mesh(folder / name);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_TRUE(same_bits(back->mesh.vertices, file.mesh.vertices)) << name;
    EXPECT_TRUE(same_faces(back->mesh.faces, file.mesh.faces)) << name;
  }
}

TEST(WriteMesh, WritesTheGivenPositionsNotTheRestOnes) {
  const ScratchFolder folder;
  const MeshFile file{sphere(0), ""};
  const Points moved = 3 * file.mesh.vertices;
  ASSERT_TRUE(write_mesh(folder / "a.off", file, moved, {}).ok());
  EXPECT_TRUE(same_bits(read_mesh(folder / "a.off")->mesh.vertices, moved));
}

TEST(WriteMesh, AnObjInputKeepsItsLinesInAFile) {
  const ScratchFolder folder;
  put_file(folder / "in.obj",
           "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1 4/1\n");
  const absl::StatusOr<MeshFile> file = read_mesh(folder / "in.obj");
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(write_mesh(folder / "out.obj", *file, 2 * file->mesh.vertices, {}).ok());
  EXPECT_EQ(file_bytes(folder / "out.obj"),
            "mtllib m.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1 4/1\n");
}

TEST(WriteMesh, PlyHasDoubleCoordinatesDistortionAndColour) {
  const ScratchFolder folder;
  const MeshFile file{make_mesh({{1, 2, 3}, {4, 5, 6}, {7, 8, 0.1}}, {{0, 1, 2}}), ""};
  const Field distortion = Eigen::Vector3d(0, 0.25, 1);
  ASSERT_TRUE(write_mesh(folder / "a.ply", file, file.mesh.vertices, distortion).ok());
  const std::vector<Rgb> colours = distortion_colours(distortion);
  std::string expected =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double "
      "y\nproperty double z\n"
      "property double distortion\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (int v = 0; v < 3; ++v) {
    for (int axis = 0; axis < 3; ++axis) append_little_endian(expected, file.mesh.vertices(v, axis));
    append_little_endian(expected, distortion[v]);
    expected.append(colours[v].begin(), colours[v].end());
  }
  expected += '\3';
  for (const std::int32_t v : {0, 1, 2}) append_little_endian(expected, v);
  EXPECT_EQ(file_bytes(folder / "a.ply"), expected);
}

TEST(WriteMesh, PlyHasNormalsWhereThereAreAny) {
  const ScratchFolder folder;
  const MeshFile file{make_mesh({{1, 2, 3}, {4, 5, 6}, {7, 8, 0.1}}, {{0, 1, 2}}), ""};
  const Points normals = Points::Constant(3, 3, 0.5);
  ASSERT_TRUE(write_mesh(folder / "a.ply", file, file.mesh.vertices, {}, normals).ok());
  const std::string bytes = file_bytes(folder / "a.ply");
  EXPECT_THAT(bytes,
              ::testing::HasSubstr("z\nproperty float nx\nproperty float ny\nproperty float nz\nelement"));
  const MeshFile again = read_mesh(folder / "a.ply").value();
  EXPECT_TRUE(same_bits(again.mesh.vertices, file.mesh.vertices));
}

TEST(WriteMesh, PlyWithoutDistortionHasNoColour) {
  const ScratchFolder folder;
  const MeshFile file{sphere(0), ""};
  ASSERT_TRUE(write_mesh(folder / "a.ply", file, file.mesh.vertices, {}).ok());
  EXPECT_THAT(file_bytes(folder / "a.ply"), ::testing::Not(::testing::HasSubstr("distortion")));
}

TEST(WriteMesh, ReplacesAFileAndLeavesNothingElseBehind) {
  const ScratchFolder folder;
  put_file(folder / "a.off", "what was there before, and longer than what comes");
  const MeshFile file{make_mesh({{0, 0, 0}}, {}), ""};
  ASSERT_TRUE(write_mesh(folder / "a.off", file, file.mesh.vertices, {}).ok());
  EXPECT_EQ(file_bytes(folder / "a.off"), "OFF\n1 0 0\n0 0 0\n");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WriteMesh, AFailureNamesTheFileAndLeavesNothingBehind) {
  const ScratchFolder folder;
  const MeshFile file{sphere(0), ""};
  const absl::Status missing = write_mesh(folder / "no/a.off", file, file.mesh.vertices, {});
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(fault_of(missing).reason, "FILE_NOT_WRITTEN");
  EXPECT_EQ(fault_of(missing).element, (folder / "no/a.off").string());
  std::filesystem::create_directory(folder / "taken.off");
  EXPECT_EQ(fault_of(write_mesh(folder / "taken.off", file, file.mesh.vertices, {})).reason,
            "FILE_NOT_WRITTEN");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WriteMesh, RefusesFormatsThatItCannotWrite) {
  const ScratchFolder folder;
  const MeshFile file{sphere(0), ""};
  for (const char* name : {"a.stl", "a.txt", "a"}) {
    const absl::Status status = write_mesh(folder / name, file, file.mesh.vertices, {});
    EXPECT_EQ(fault_of(status).reason, "MESH_FORMAT_UNKNOWN") << name;
  }
}

TEST(ReadMesh, KnowsFormatsByTheirEndingInAnyCase) {
  EXPECT_EQ(mesh_format("a/b.off").value(), MeshFormat::kOff);
  EXPECT_EQ(mesh_format("b.OBJ").value(), MeshFormat::kObj);
  EXPECT_EQ(mesh_format("x.y.Ply").value(), MeshFormat::kPly);
  EXPECT_EQ(mesh_format("c.sTl").value(), MeshFormat::kStl);
  EXPECT_EQ(fault_of(mesh_format("c.gltf").status()).reason, "MESH_FORMAT_UNKNOWN");
  EXPECT_EQ(fault_of(read_mesh("c.gltf").status()).reason, "MESH_FORMAT_UNKNOWN");
}

TEST(ReadMesh, NamesAFileThatIsNotThere) {
  const ScratchFolder folder;
  const absl::Status status = read_mesh(folder / "none.off").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(fault_of(status).reason, "MESH_FILE_NOT_FOUND");
  EXPECT_EQ(fault_of(status).element, (folder / "none.off").string());
  std::filesystem::create_directory(folder / "folder.off");
  EXPECT_EQ(fault_of(read_mesh(folder / "folder.off").status()).reason, "MESH_FILE_NOT_FOUND");
}

TEST(ReadMesh, OnlyObjKeepsItsSource) {
  EXPECT_EQ(parse_mesh("v 0 0 0\n", MeshFormat::kObj)->obj_source, "v 0 0 0\n");
  EXPECT_EQ(parse_mesh("OFF\n0 0 0\n", MeshFormat::kOff)->obj_source, "");
}

}  // namespace
}  // namespace lpdeform
