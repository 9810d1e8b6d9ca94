#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lpdeform/core.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace lpdeform::core {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <typename Number>
void append(std::string& bytes, const std::vector<Number>& numbers) {
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

constexpr std::uint32_t kCells = 10;
constexpr std::size_t kPositionBytes = std::size_t{2} * kCells * 4 * 3 * 4;

/// A strip of two rows of kCells squares, whose rows share no vertices: a seam runs between them. It has texture coordinates, a
/// material and an extra. The node stands 5 above the ground.
std::string strip_glb() {
  std::vector<float> positions, texture;
  std::vector<std::uint16_t> corners;
  for (std::uint32_t cell = 0; cell < 2 * kCells; ++cell) {
    const float x = static_cast<float>(cell % kCells), y = static_cast<float>(cell / kCells);
    positions.insert(positions.end(), {x, y, 0, x + 1, y, 0, x + 1, y + 1, 0, x, y + 1, 0});
    texture.insert(texture.end(), {0, 0, 1, 0, 1, 1, 0, 1});
    for (const int corner : {0, 1, 2, 0, 2, 3})
      corners.push_back(static_cast<std::uint16_t>(4 * cell + static_cast<std::uint32_t>(corner)));
  }
  std::string buffer;
  append(buffer, positions);
  append(buffer, texture);
  append(buffer, corners);
  const std::string count = std::to_string(positions.size() / 3);
  const std::string texture_at = std::to_string(kPositionBytes);
  const std::string corners_at = std::to_string(kPositionBytes + 4 * texture.size());
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"name":"strip","translation":[0,0,5]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],)"
      R"("materials":[{"name":"paper","extras":{"keep":"me"}}],"accessors":[)"
      R"({"bufferView":0,"componentType":5126,"type":"VEC3","min":[0,0,0],"max":[10,2,0],"count":)" +
      count + R"(},{"bufferView":1,"componentType":5126,"type":"VEC2","count":)" + count +
      R"(},{"bufferView":2,"componentType":5123,"type":"SCALAR","count":)" + std::to_string(corners.size()) +
      R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + texture_at + R"(},{"buffer":0,"byteOffset":)" +
      texture_at + R"(,"byteLength":)" + std::to_string(4 * texture.size()) +
      R"(},{"buffer":0,"byteOffset":)" + corners_at + R"(,"byteLength":)" +
      std::to_string(2 * corners.size()) + R"(}],"buffers":[{"byteLength":)" + std::to_string(buffer.size()) +
      "}]}";
  json.append((4 - json.size() % 4) % 4, ' ');
  buffer.append((4 - buffer.size() % 4) % 4, '\0');
  const auto size = [](std::size_t bytes) { return static_cast<std::uint32_t>(bytes); };
  std::string glb = "glTF";
  append<std::uint32_t>(glb,
                        {2, size(12 + 8 + json.size() + 8 + buffer.size()), size(json.size()), 0x4E4F534A});
  glb += json;
  append<std::uint32_t>(glb, {size(buffer.size()), 0x004E4942});
  return glb + buffer;
}

/// A folder that goes with the test.
class MeshFiles : public testing::Test {
 protected:
  MeshFiles() {
    folder_ =
        testing::TempDir() + "mesh_files_" + testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
  }
  ~MeshFiles() override { std::filesystem::remove_all(folder_); }

  std::string at(const std::string& name) const { return folder_ + "/" + name; }

  MeshFile read(const std::string& name, const std::string& bytes) const {
    write_bytes(at(name), bytes);
    return MeshFile::read(at(name)).value();
  }

  Error refusal(const std::string& name, const std::string& bytes) const {
    write_bytes(at(name), bytes);
    const auto file = MeshFile::read(at(name));
    return file ? Error{.reason = "accepted"} : file.error();
  }

 private:
  std::string folder_;
};

TEST_F(MeshFiles, AGlbComesBackToTheBitAtRest) {
  const MeshFile file = read("strip.glb", strip_glb());
  EXPECT_TRUE(file.splits_vertices());
  EXPECT_EQ(file.mesh().vertices.size(), 2 * kCells * 4 * 3);
  EXPECT_EQ(file.mesh().vertices[2], 5) << "where the scene has it";
  ASSERT_TRUE(file.write(at("again.glb"), file.mesh().vertices));
  EXPECT_EQ(bytes_of(at("again.glb")), strip_glb());
}

TEST_F(MeshFiles, AGlbIsWeldedDeformedAndWrittenWithAllElseAsItCame) {
  const MeshFile file = read("strip.glb", strip_glb());
  const WeldedMesh welded = weld(file.mesh()).value();
  EXPECT_EQ(welded.mesh.vertices.size(), 3 * (kCells + 1) * 3);
  Handle base, tip{.motion = RigidMotion{.translation = {0, 0, 3}}};
  for (std::uint32_t v = 0; v < welded.mesh.vertices.size() / 3; ++v) {
    if (welded.mesh.vertices[3 * v] == 0) base.vertices.push_back(v);
    if (welded.mesh.vertices[3 * v] == kCells) tip.vertices.push_back(v);
  }
  const SolveResult bent = deform(welded.mesh, {{"base", base}, {"tip", tip}}).value();
  const std::vector<double> positions = welded.spread(bent.positions);
  ASSERT_TRUE(file.write(at("bent.glb"), positions));

  const std::string before = strip_glb(), after = bytes_of(at("bent.glb"));
  const std::size_t texture_and_corners = std::size_t{2} * kCells * (4 * 2 * 4 + 6 * 2);
  EXPECT_EQ(before.substr(before.size() - texture_and_corners),
            after.substr(after.size() - texture_and_corners));
  EXPECT_THAT(after, HasSubstr(R"({"name":"paper","extras":{"keep":"me"}})"));
  const MeshFile again = MeshFile::read(at("bent.glb")).value();
  EXPECT_EQ(again.mesh().faces, file.mesh().faces);
  EXPECT_THAT(again.mesh().vertices, testing::Pointwise(testing::FloatNear(1e-5F), positions));
}

TEST_F(MeshFiles, AGlbSaysWhatItDrawsByName) {
  const MeshFile file = read("strip.glb", strip_glb());
  ASSERT_EQ(file.parts().size(), 1);
  EXPECT_EQ(file.parts()[0].node, "strip");
  EXPECT_EQ(file.parts()[0].count, 2 * kCells * 4);
  std::vector<std::string> names;
  for (const MeshGroup& group : file.groups()) names.push_back(group.name);
  EXPECT_THAT(names, ElementsAre("paper", "strip"));
  EXPECT_EQ(file.groups()[0].vertices.size(), 2 * kCells * 4);
  EXPECT_TRUE(file.notices().empty());
}

TEST_F(MeshFiles, AnObjKeepsItsOtherLines) {
  const std::string before =
      "mtllib cloth.mtl\r\nv 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nvt 0 0\r\ng sheet\r\nusemtl red\r\n"
      "f 1/1 2/1 3/1 4/1\r\n";
  const MeshFile file = read("sheet.obj", before);
  EXPECT_FALSE(file.splits_vertices());
  EXPECT_TRUE(file.groups().empty());
  std::vector<double> positions = file.mesh().vertices;
  positions[2] = 7;
  ASSERT_TRUE(file.write(at("bent.obj"), positions));
  std::string after = before;
  after.replace(after.find("v 0 0 0"), 7, "v 0 0 7");
  EXPECT_EQ(bytes_of(at("bent.obj")), after);
}

TEST_F(MeshFiles, AnObjWithNormalsThatCannotBeTurnedIsRefusedAndNothingIsWritten) {
  const MeshFile file = read("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nvn 0 0 1\nf 1//1 2//1 3//1\n");
  const auto written = file.write(at("out.obj"), file.mesh().vertices);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().reason, "MESH_NO_AREA");
  EXPECT_FALSE(std::filesystem::exists(at("out.obj")));
}

TEST_F(MeshFiles, AMeshWithoutAFileBecomesAGlbAndIsReadAgain) {
  const Mesh triangle{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}};
  for (const char* name : {"a.glb", "a.gltf", "a.off", "a.obj", "a.ply"}) {
    ASSERT_TRUE(write_mesh(at(name), triangle)) << name;
    const Mesh again = read_mesh(at(name)).value();
    EXPECT_EQ(again.vertices, triangle.vertices) << name;
    EXPECT_EQ(again.faces, triangle.faces) << name;
  }
}

TEST_F(MeshFiles, WhatCannotBeReadIsRefusedByItsPart) {
  const std::string glb = strip_glb();
  const Error cut = refusal("cut.glb", glb.substr(0, glb.size() - 8));
  EXPECT_EQ(cut.reason, "MESH_SYNTAX");
  std::string draco =
      R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"],"scene":0,)"
      R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},)"
      R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],)"
      R"("accessors":[{"componentType":5126,"count":3,"type":"VEC3"}]})";
  const Error compressed = refusal("draco.gltf", draco);
  EXPECT_EQ(compressed.reason, "MESH_UNSUPPORTED");
  EXPECT_THAT(compressed.text, HasSubstr("KHR_draco_mesh_compression"));
  EXPECT_EQ(refusal("mesh.fbx", "").reason, "MESH_FORMAT_UNKNOWN");
  EXPECT_EQ(MeshFile::read(at("none.glb")).error().reason, "MESH_FILE_NOT_FOUND");
}

TEST_F(MeshFiles, WhatCannotBeWrittenIsRefused) {
  const MeshFile file = read("strip.glb", strip_glb());
  EXPECT_EQ(file.write(at("out.glb"), {1, 2, 3}).error().reason, "POSITIONS_SIZE");
  std::vector<double> far = file.mesh().vertices;
  far[0] = 1e300;
  EXPECT_EQ(file.write(at("out.glb"), far).error().reason, "MESH_UNSUPPORTED");
  EXPECT_EQ(file.write(at("out.glb"), file.mesh().vertices, {.weld = 7.0}).error().reason, "WELD_TOLERANCE");
  EXPECT_EQ(file.write(at("no/out.glb"), file.mesh().vertices).error().reason, "FILE_NOT_WRITTEN");
  EXPECT_FALSE(std::filesystem::exists(at("out.glb")));
  for (const char* name : {"out.stl", "out.fbx"}) {
    const Error error = file.write(at(name), file.mesh().vertices).error();
    EXPECT_EQ(error.reason, "MESH_FORMAT_UNKNOWN");
    EXPECT_EQ(error.limit, "one of .glb, .gltf, .off, .obj, .ply") << "what can be written, and nothing else";
    EXPECT_THAT(error.text, testing::Not(HasSubstr(".stl and"))) << error.text;
  }
  EXPECT_EQ(write_mesh(at("out.glb"), {{0, 0, 0}, {0, 1, 2}}).error().reason, "MESH_INDEX_OUT_OF_RANGE");
  EXPECT_EQ(write_mesh(at("out.glb"), {}).error().reason, "MESH_EMPTY");
}

}  // namespace
}  // namespace lpdeform::core
