#include "core/gltf/gltf.h"

#include <Eigen/Geometry>
#include <array>
#include <random>
#include <vector>

#include "core/base/fault.h"
#include "core/gltf/uris.h"
#include "core/mesh/report.h"
#include "tests/core/gltf/made_gltf.h"
#include "tests/core/mesh_support.h"

namespace lpdeform::gltf {
namespace {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

Gltf parsed(const std::string& bytes, const std::filesystem::path& folder = {}) {
  auto file = Gltf::parse(bytes, folder);
  EXPECT_TRUE(file.ok()) << file.status();
  return *std::move(file);
}

/// The JSON of a GLB.
ordered_json json_of(const std::string& glb) {
  return ordered_json::parse(parse_container(glb).json);
}

std::string binary_of(const std::string& glb) {
  return std::string(parse_container(glb).binary.value());
}

Points moved(const Gltf& file, double z) {
  Points positions = file.mesh().vertices;
  positions.col(2).array() += z;
  return positions;
}

/// A node with the split square.
MadeGltf square(const ordered_json& node = {{"mesh", 0}}) {
  MadeGltf made;
  const int position = made.floats(kSquare, "VEC3", 3);
  made.mesh({{{"attributes", {{"POSITION", position}}}}});
  made.node(node);
  return made;
}

std::string bytes_of(const Gltf& file, const Points& positions, Packing packing = Packing::kGlb) {
  const auto bytes = file.bytes(positions, packing, 0.0);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return *bytes;
}

/// The reason and the element.
std::pair<std::string, std::string> refusal(MadeGltf made) {
  const auto file = Gltf::parse(made.glb(), {});
  if (file.ok()) return {"accepted", ""};
  EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(file.status().message(), HasSubstr(fault_of(file.status()).element.substr(1)));
  return {fault_of(file.status()).reason, fault_of(file.status()).element};
}

TEST(Gltf, AtRestAFileComesBackToTheLastBit) {
  const std::string glb = rich_gltf().glb();
  const Gltf file = parsed(glb);
  EXPECT_EQ(bytes_of(file, file.mesh().vertices), glb);
}

TEST(Gltf, OnlyPositionsNormalsAndTangentsOfADeformedFileDiffer) {
  const std::string glb = rich_gltf().glb();
  const Gltf file = parsed(glb);
  const Eigen::AngleAxisd turn(0.5, Eigen::Vector3d::UnitY());
  const Points positions = file.mesh().vertices * turn.toRotationMatrix().transpose();
  const std::string out = bytes_of(file, positions);

  ordered_json before = json_of(glb), after = json_of(out);
  EXPECT_NE(before["accessors"][0]["max"], after["accessors"][0]["max"]);
  for (ordered_json* json : {&before, &after})
    (*json)["accessors"][0].erase("min"), (*json)["accessors"][0].erase("max");
  EXPECT_EQ(before, after);
  const std::size_t changed = 6 * (12 + 12 + 16);  // the first three views
  EXPECT_EQ(binary_of(glb).substr(changed), binary_of(out).substr(changed));

  const Gltf again = parsed(out);
  EXPECT_LT((again.mesh().vertices - positions).norm(), 1e-6);
  std::vector<float> copied(changed / 4);
  std::memcpy(copied.data(), binary_of(out).data(), changed);
  const Eigen::Vector3d normal = turn * Eigen::Vector3d::UnitZ(), tangent = turn * Eigen::Vector3d::UnitX();
  for (int vertex = 0; vertex < 6; ++vertex) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(copied[18 + 3 * vertex + axis], normal[axis], 1e-6);
      EXPECT_NEAR(copied[36 + 4 * vertex + axis], tangent[axis], 1e-6);
    }
    EXPECT_EQ(copied[36 + 4 * vertex + 3], vertex < 3 ? 1 : -1);
  }
}

TEST(Gltf, EachNodeDrawsWithItsOwnTransformAndIsWrittenBackInItsOwnCoordinates) {
  MadeGltf made = square(
      {{"mesh", 0}, {"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}, {"children", {1}}, {"name", "whole"}});
  made.root["meshes"].push_back(made.root["meshes"][0]);
  made.root["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = made.floats(kSquare, "VEC3", 3);
  made.node({{"mesh", 1}, {"translation", {0, 0, 3}}, {"name", "part"}});
  const std::string glb = made.glb();
  const Gltf file = parsed(glb);
  ASSERT_EQ(file.mesh().vertices.rows(), 12);
  EXPECT_EQ(file.mesh().vertices.row(1), Eigen::RowVector3d(12, 0, 0));
  EXPECT_EQ(file.mesh().vertices.row(7), Eigen::RowVector3d(12, 0, 6));
  EXPECT_EQ(file.parts()[1].node, "part");
  EXPECT_EQ(file.parts()[1].first, 6);

  Points positions = file.mesh().vertices;
  positions.bottomRows(6).col(2).array() += 4;
  const std::string out = bytes_of(file, positions);
  EXPECT_EQ(json_of(out)["nodes"], json_of(glb)["nodes"]);
  EXPECT_EQ(json_of(out)["accessors"][1]["max"], ordered_json({1, 1, 2}));
  EXPECT_EQ(binary_of(out).substr(0, 72), binary_of(glb).substr(0, 72)) << "the first node did not move";
  EXPECT_EQ(parsed(out).mesh().vertices, positions);
}

TEST(Gltf, AMeshThatSeveralNodesDrawBecomesOnePerNodeThatDeformsIt) {
  MadeGltf made = square();
  made.node({{"mesh", 0}, {"translation", {0, 0, 5}}});
  made.node({{"mesh", 0}, {"translation", {0, 0, 9}}});
  made.root["scenes"][0]["nodes"] = {0, 1};  // the third is in no scene, and must not change
  const Gltf file = parsed(made.glb());
  Points positions = file.mesh().vertices;
  positions(7, 0) = 1.5;
  const std::string out = bytes_of(file, positions);
  EXPECT_EQ(parsed(out).mesh().vertices, positions);
  ordered_json third = json_of(out);
  third["scenes"][0]["nodes"] = {2};
  const Gltf drawn = parsed(glb_bytes(third.dump(), binary_of(out), {}));
  EXPECT_EQ(drawn.mesh().vertices.row(1), Eigen::RowVector3d(1, 0, 9));
}

TEST(Gltf, MirroredNodesFaceOutwards) {
  const Gltf plain = parsed(square().glb()),
             mirrored = parsed(square({{"mesh", 0}, {"scale", {-1, 1, 1}}}).glb());
  EXPECT_EQ(plain.mesh().faces.row(0), Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(mirrored.mesh().faces.row(0), Eigen::RowVector3i(0, 2, 1));
}

TEST(Gltf, StripsAndFansAreTriangles) {
  for (const int mode : {5, 6}) {
    MadeGltf made = square();
    made.root["meshes"][0]["primitives"][0]["mode"] = mode;
    made.root["meshes"][0]["primitives"][0]["indices"] = made.indices({0, 1, 2, 5});
    const Faces faces = parsed(made.glb()).mesh().faces;
    ASSERT_EQ(faces.rows(), 2);
    EXPECT_EQ(faces.row(0), Eigen::RowVector3i(0, 1, 2));
    EXPECT_EQ(faces.row(1), mode == 5 ? Eigen::RowVector3i(1, 5, 2) : Eigen::RowVector3i(0, 2, 5));
  }
}

TEST(Gltf, InterleavedPositionsAreWrittenWhereTheyLie) {
  MadeGltf made;
  std::vector<float> rows;
  for (int vertex = 0; vertex < 6; ++vertex) {
    rows.insert(rows.end(), kSquare.begin() + 3 * vertex, kSquare.begin() + 3 * vertex + 3);
    rows.insert(rows.end(), {0.25F * vertex, 0.5F});
  }
  const int view = made.view(rows, 20);
  const int position = made.accessor(view, "VEC3", 5126, 6),
            texture = made.accessor(view, "VEC2", 5126, 6, 12);
  made.mesh({{{"attributes", {{"POSITION", position}, {"TEXCOORD_0", texture}}}}});
  made.node({{"mesh", 0}});
  const std::string glb = made.glb();
  const Gltf file = parsed(glb);
  const std::string out = bytes_of(file, moved(file, 1));
  EXPECT_EQ(json_of(out)["bufferViews"], json_of(glb)["bufferViews"]);
  EXPECT_EQ(parsed(out).mesh().vertices, moved(file, 1));
  for (std::size_t vertex = 0; vertex < 6; ++vertex)
    EXPECT_EQ(binary_of(out).substr(20 * vertex + 12, 8), binary_of(glb).substr(20 * vertex + 12, 8));
}

TEST(Gltf, WhatOthersUseIsNotOverwritten) {
  MadeGltf made = rich_gltf();
  made.root["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = 0;
  const std::string glb = made.glb();
  const Gltf file = parsed(glb);
  const std::string out = bytes_of(file, moved(file, 1));
  EXPECT_EQ(binary_of(out).substr(0, 72), binary_of(glb).substr(0, 72));
  EXPECT_EQ(json_of(out)["meshes"][0]["primitives"][0]["attributes"]["POSITION"],
            json_of(glb)["accessors"].size());
  EXPECT_EQ(parsed(out).mesh().vertices, moved(file, 1));
}

TEST(Gltf, SparseAndSmallIntegerPositionsAreReadAndBecomeFloats) {
  MadeGltf sparse = square();
  const int rows = sparse.view(std::vector<std::uint8_t>{5}),
            values = sparse.view(std::vector<float>{0, 2, 0});
  sparse.root["accessors"][0]["sparse"] = {{"count", 1},
                                           {"indices", {{"bufferView", rows}, {"componentType", 5121}}},
                                           {"values", {{"bufferView", values}}}};
  MadeGltf small = square();
  small.root["accessors"][0] = small.root["accessors"][small.accessor(
      small.view(std::vector<std::int16_t>{0, 0, 0, 0, 32767, 0,     0, 0, 32767, 32767, 0, 0,
                                           0, 0, 0, 0, 32767, 32767, 0, 0, 0,     32767, 0, 0},
                 8),
      "VEC3", 5122, 6)];
  small.root["accessors"][0]["normalized"] = true;
  small.root["extensionsRequired"] = {"KHR_mesh_quantization"};
  for (const auto& [made, corner] : {std::pair(sparse, 2.0), std::pair(small, 1.0)}) {
    MadeGltf copy = made;
    const Gltf file = parsed(copy.glb());
    EXPECT_EQ(file.mesh().vertices.row(5), Eigen::RowVector3d(0, corner, 0));
    EXPECT_EQ(file.mesh().vertices.row(1), Eigen::RowVector3d(1, 0, 0));
    EXPECT_EQ(parsed(bytes_of(file, moved(file, 1))).mesh().vertices, moved(file, 1));
  }
}

TEST(Gltf, ASkinnedMeshStandsWhereItsJointsPlaceIt) {
  MadeGltf made = rich_gltf();
  made.root["nodes"][0]["skin"] = 0;
  made.root["nodes"][0]["translation"] = {100, 0, 0};  // does not count
  made.node({{"translation", {0, 0, 2}}});
  made.root["skins"] = {{{"joints", {1}}}};
  made.root["scenes"][0]["nodes"] = {0, 1};
  EXPECT_EQ(parsed(made.glb()).mesh().vertices.row(1), Eigen::RowVector3d(1, 0, 2));
}

TEST(Gltf, NodesThatShareASkinStandWhereItPlacesThem) {
  MadeGltf made = rich_gltf();
  made.node({{"translation", {0, 0, 2}}});
  made.node({{"mesh", 0}, {"skin", 0}, {"translation", {7, 0, 0}}});
  made.root["nodes"][0]["skin"] = 0;
  made.root["skins"] = {{{"joints", {1}}}};
  made.root["scenes"][0]["nodes"] = {0, 1, 2};
  const Points vertices = parsed(made.glb()).mesh().vertices;
  ASSERT_EQ(vertices.rows() % 2, 0);
  EXPECT_EQ(vertices.topRows(vertices.rows() / 2), vertices.bottomRows(vertices.rows() / 2));
  EXPECT_EQ(vertices(1, 2), 2);
}

TEST(Gltf, NamesOfNodesMeshesAndMaterialsAreGroups) {
  std::vector<std::string> names;
  for (const NamedVertices& group : parsed(rich_gltf().glb()).groups()) {
    names.push_back(group.name);
    EXPECT_THAT(group.vertices, ElementsAre(0, 1, 2, 3, 4, 5));
  }
  EXPECT_THAT(names, ElementsAre("page", "paper", "sheet"));
}

TEST(Gltf, LinesStayAsTheyAreAndAreNamed) {
  MadeGltf made = square();
  ordered_json lines = made.root["meshes"][0]["primitives"][0];
  lines["mode"] = 1;
  made.root["meshes"][0]["primitives"].push_back(lines);
  EXPECT_THAT(parsed(made.glb()).notices(),
              ElementsAre("The lines of primitive 1 of mesh 0 stay as they are."));
}

TEST(Gltf, CornersThatMakeNoTriangleAreNamed) {
  MadeGltf made = square();
  const ordered_json whole = made.root["meshes"][0]["primitives"][0];
  const auto add = [&](int mode, const std::vector<std::uint16_t>& corners) {
    ordered_json other = whole;
    other["mode"] = mode;
    other["indices"] = made.indices(corners);
    made.root["meshes"][0]["primitives"].push_back(other);
  };
  add(4, {0, 1, 2, 0, 1});
  add(5, {0, 1});
  add(6, {0});
  add(5, {0, 1, 2, 3});
  const Gltf file = parsed(made.glb());
  EXPECT_EQ(file.mesh().faces.rows(), parsed(square().glb()).mesh().faces.rows() + 3);
  EXPECT_THAT(file.notices(),
              ElementsAre("Corners at the end of primitive 1 of mesh 0 make no triangle: 2 of 5.",
                          "Corners at the end of primitive 2 of mesh 0 make no triangle: 2 of 2.",
                          "Corners at the end of primitive 3 of mesh 0 make no triangle: 1 of 1."));
}

TEST(Gltf, RefusalsNameThePart) {
  const std::string syntax = "MESH_SYNTAX", unsupported = "MESH_UNSUPPORTED";
  using Change = void (*)(MadeGltf&);
  const std::vector<std::tuple<Change, std::string, std::string>> cases{
      {[](MadeGltf& m) {
         m.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
             {"bufferView", 0}};
       },
       unsupported, "primitive 0 of mesh 0 (\"sheet\")"},
      {[](MadeGltf& m) {
         m.root["bufferViews"][2]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0}};
       },
       unsupported, "bufferView 2"},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {"ACME_secret"}; }, unsupported,
       "the extension \"ACME_secret\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {"KHR_draco_mesh_compression"}; }, unsupported,
       "the extension \"KHR_draco_mesh_compression\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {"EXT_meshopt_compression"}; }, unsupported,
       "the extension \"EXT_meshopt_compression\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {""}; }, unsupported, "the extension \"\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {std::string(5000, 'x')}; }, unsupported,
       "the extension \"" + std::string(60, 'x') + "...\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = "KHR_draco_mesh_compression"; }, syntax,
       "\"extensionsRequired\""},
      {[](MadeGltf& m) { m.root["extensionsRequired"] = {7}; }, syntax, "\"extensionsRequired\""},
      {[](MadeGltf& m) {
         m.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {{"attributes", {}}};
       },
       unsupported, "node 0 (\"page\")"},
      {[](MadeGltf& m) { m.root["asset"]["version"] = "1.0"; }, unsupported, "the file"},
      {[](MadeGltf& m) { m.root.erase("asset"); }, syntax, "the JSON"},
      {[](MadeGltf& m) {
         for (int k = 0; k < 100; ++k) m.root[std::to_string(k)] = k;
       },
       syntax, "the JSON"},
      {[](MadeGltf& m) {
         for (int k = 0; k < 100; ++k) m.root["accessors"][0][std::to_string(k)] = k;
       },
       syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["count"] = 7; }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["count"] = -1; }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["count"] = 1e9; }, unsupported, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["byteOffset"] = 4; }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0].erase("bufferView"); }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["type"] = "VEC2"; }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][0]["componentType"] = 5124; }, syntax, "accessor 0"},
      {[](MadeGltf& m) { m.root["accessors"][1]["count"] = 5; }, syntax, "primitive 0 of mesh 0 (\"sheet\")"},
      {[](MadeGltf& m) {
         m.root["accessors"][0]["sparse"] = {{"count", 9}};
       },
       syntax, "\"sparse\" of accessor 0"},
      {[](MadeGltf& m) { m.root["bufferViews"][0]["byteLength"] = 1e6; }, syntax, "bufferView 0"},
      {[](MadeGltf& m) { m.root["bufferViews"][0]["byteStride"] = 4; }, syntax, "bufferView 0"},
      {[](MadeGltf& m) {
         m.root["meshes"][0]["primitives"][0]["indices"] = m.indices({0, 1, 6});
       },
       syntax, "primitive 0 of mesh 0 (\"sheet\")"},
      {[](MadeGltf& m) { m.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99; }, syntax,
       "primitive 0 of mesh 0 (\"sheet\")"},
      {[](MadeGltf& m) { m.root["meshes"][0]["primitives"][0]["mode"] = 1; }, syntax, "the scene"},
      {[](MadeGltf& m) { m.root["nodes"][0]["mesh"] = 3; }, syntax, "node 0 (\"page\")"},
      {[](MadeGltf& m) { m.root["nodes"][0]["children"] = {0}; }, syntax, "the nodes"},
      {[](MadeGltf& m) {
         m.root["nodes"][0]["matrix"] = {1, 2};
       },
       syntax, "node 0 (\"page\")"},
      {[](MadeGltf& m) { m.root["materials"] = ""; }, syntax, "\"materials\""},
      {[](MadeGltf& m) { m.root["images"] = ""; }, syntax, "\"images\""}};
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const auto& [change, reason, element] = cases[k];
    MadeGltf made = rich_gltf();
    change(made);
    EXPECT_EQ(refusal(std::move(made)), std::pair(reason, element)) << "case " << k;
  }
}

TEST(Gltf, MessagesAreUtf8WhateverAFileSays) {
  std::string umlauts = "x";
  for (int k = 0; k < 100; ++k) umlauts += "\u00fc";
  MadeGltf version = rich_gltf(), extension = rich_gltf();
  version.root["asset"]["version"] = umlauts;
  extension.root["extensionsRequired"] = {umlauts};
  std::vector<std::string> files{version.glb(), extension.glb()};
  for (const std::string& uri : {umlauts, "../" + umlauts, std::string("%ff.bin"), std::string("../%ff")}) {
    MadeGltf made = rich_gltf();
    made.root["buffers"] = {{{"byteLength", made.buffer.size()}, {"uri", uri}}};
    files.push_back(made.root.dump());
  }
  for (const std::string& file : files) {
    const absl::Status status = Gltf::parse(file, {}).status();
    ASSERT_FALSE(status.ok());
    EXPECT_NO_THROW(ordered_json(std::string(status.message())).dump()) << "dump() takes UTF-8 alone";
    EXPECT_NO_THROW(ordered_json(fault_of(status).element).dump());
  }
}

TEST(Gltf, DeepJsonIsRefused) {
  const auto file =
      Gltf::parse("{\"asset\":" + std::string(100000, '[') + std::string(100000, ']') + "}", {});
  EXPECT_EQ(fault_of(file.status()).element, "the JSON");
}

TEST(Gltf, BuffersAndImagesLieInTheFolderAndNowhereElse) {
  const ScratchFolder folder;
  MadeGltf made = rich_gltf();
  const auto write = [](const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  };
  std::filesystem::create_directory(folder / "in");
  write(folder / "in/my data.bin", made.buffer);
  write(folder / "in/a.png", "\x89PNG-file");
  write(folder / "secret.bin", made.buffer);
  std::filesystem::create_symlink(folder / "secret.bin", folder / "in/link.bin");
  made.root["images"] = {
      {{"uri", "a.png"}}, {{"uri", "../secret.bin"}}, {{"uri", "https://example.org/b.png"}}};
  const auto with_uri = [&](const std::string& uri) {
    made.root["buffers"] = {{{"byteLength", made.buffer.size()}, {"uri", uri}}};
    return made.root.dump();
  };
  const Gltf file = parsed(with_uri("my%20data.bin"), folder / "in");
  for (const std::string uri :
       {"../secret.bin", "link.bin", "/etc/hostname", "http://example.org/a.bin", "none.bin", "",
        "%2e%2e/secret.bin", "my%2", "data:;base64,@@@@", "file:///etc/hostname"}) {
    const auto refused = Gltf::parse(with_uri(uri), folder / "in");
    EXPECT_EQ(fault_of(refused.status()).element, "buffer 0") << uri;
  }

  const std::string glb = bytes_of(file, moved(file, 1));
  const ordered_json images = json_of(glb)["images"];
  EXPECT_EQ(images[0].value("mimeType", ""), "image/png");
  const ordered_json view = json_of(glb)["bufferViews"][images[0]["bufferView"].get<int>()];
  EXPECT_EQ(binary_of(glb).substr(view["byteOffset"], view["byteLength"]), "\x89PNG-file");
  EXPECT_EQ(images[1], ordered_json({{"uri", "../secret.bin"}})) << "what lies outside stays outside";
  EXPECT_EQ(images[2], ordered_json({{"uri", "https://example.org/b.png"}}));

  const ordered_json text = ordered_json::parse(bytes_of(file, moved(file, 1), Packing::kGltf));
  EXPECT_EQ(data_of(text["images"][0]["uri"].get<std::string>()), "\x89PNG-file");
  EXPECT_EQ(parsed(text.dump()).mesh().vertices, moved(file, 1)) << "it needs no other file";
}

/// The current folder for a while.
class Within {
 public:
  explicit Within(const std::filesystem::path& folder) : before_(std::filesystem::current_path()) {
    std::filesystem::current_path(folder);
  }
  ~Within() { std::filesystem::current_path(before_); }
  Within(const Within&) = delete;
  Within& operator=(const Within&) = delete;

 private:
  const std::filesystem::path before_;
};

TEST(Gltf, ImagesAreFoundFromEverywhereAndAreMissedOnceTheyAreGone) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder / "in");
  MadeGltf made = square();
  made.root["images"] = {{{"uri", "a.png"}}, {{"uri", "never.png"}}};
  std::ofstream(folder / "in/a.glb", std::ios::binary) << made.glb();
  std::ofstream(folder / "in/a.png", std::ios::binary) << "a picture";
  const auto file = [&] {
    const Within there(folder / ".");
    return Gltf::read("in/a.glb");
  }();
  ASSERT_TRUE(file.ok()) << file.status();
  for (const Packing packing : {Packing::kGlb, Packing::kGltf})
    EXPECT_EQ(bytes_of(*file, moved(*file, 1), packing).find("a.png"), std::string::npos);
  std::filesystem::remove(folder / "in/a.png");
  for (const Packing packing : {Packing::kGlb, Packing::kGltf}) {
    const auto bytes = file->bytes(moved(*file, 1), packing, 0.0);
    EXPECT_EQ(fault_of(bytes.status()).element, "image 0");
    EXPECT_THAT(bytes.status().message(), HasSubstr("a.png"));
  }
}

TEST(Gltf, SeveralBuffersBecomeOneInAGlb) {
  MadeGltf made = rich_gltf();
  const std::string second(kSquare.size() * 4, '\x3e');
  made.root["bufferViews"].push_back({{"buffer", 1}, {"byteLength", second.size()}});
  made.root["meshes"][0]["primitives"][0]["attributes"]["_OWN"] =
      made.accessor(static_cast<int>(made.root["bufferViews"].size()) - 1, "VEC3", 5126, 6);
  made.root["buffers"] = {{{"byteLength", made.buffer.size()}},
                          {{"byteLength", second.size()}, {"uri", data_uri("a/b", second)}}};
  const Gltf file = parsed(glb_bytes(made.root.dump(), made.buffer, {}));
  const std::string out = bytes_of(file, moved(file, 1));
  const ordered_json json = json_of(out);
  EXPECT_EQ(json["buffers"].size(), 1U);
  EXPECT_EQ(binary_of(out).substr(json["bufferViews"].back()["byteOffset"], second.size()), second);
}

TEST(Gltf, NewValuesBesideSeveralBuffersAreInTheOneOfAGlb) {
  MadeGltf made = rich_gltf();
  const std::string second(16, '\x3e');
  made.root["bufferViews"].push_back({{"buffer", 1}, {"byteLength", second.size()}});
  made.root["buffers"] = {{{"byteLength", made.buffer.size()}},
                          {{"byteLength", second.size()}, {"uri", data_uri("a/b", second)}}};
  ordered_json& attributes = made.root["meshes"][0]["primitives"][0]["attributes"];
  attributes["_OWN"] =
      attributes["POSITION"];  // stays as it is, so that positions need an accessor of their own
  const Gltf file = parsed(glb_bytes(made.root.dump(), made.buffer, {}));
  const Points wanted = moved(file, 1);
  EXPECT_TRUE(parsed(bytes_of(file, wanted)).mesh().vertices.isApprox(wanted, 1e-6));
}

TEST(Gltf, AMeshFromElsewhereBecomesAFileOfItsOwn) {
  const TriangleMesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const auto file = Gltf::of_mesh(mesh);
  ASSERT_TRUE(file.ok());
  Points positions = mesh.vertices;
  positions(2, 1) = 7;
  const auto bytes = file->bytes(positions, Packing::kGltf, std::nullopt, true);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(parsed(*bytes).mesh().vertices, positions);
  EXPECT_TRUE(same_faces(parsed(*bytes).mesh().faces, mesh.faces));
  EXPECT_TRUE(ordered_json::parse(*bytes)["meshes"][0]["primitives"][0]["attributes"].contains("NORMAL"));
  positions(0, 0) = 1e300;
  EXPECT_EQ(fault_of(file->bytes(positions, Packing::kGlb, std::nullopt).status()).element, "vertex 0");
}

void collect(ordered_json& value, std::vector<ordered_json*>& all) {
  all.push_back(&value);
  if (!value.is_structured()) return;
  for (ordered_json& inner : value) collect(inner, all);
}

/// The GLB with one value of its JSON replaced by one of another kind.
std::string with_value_replaced(const std::string& glb, std::mt19937& random) {
  ordered_json root = json_of(glb);
  std::vector<ordered_json*> values;
  collect(root, values);
  const std::array<ordered_json, 4> others{nullptr, "", ordered_json::array(), 1};
  *values[random() % values.size()] = others[random() % others.size()];
  return glb_bytes(root.dump(), binary_of(glb), {});
}

/// Damaged in bytes, cut off, or with a value or numbers of the JSON changed.
std::string damaged(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
  };
  const std::size_t json_end = bytes.find("BIN");
  switch (below(6)) {
    case 0:
      return bytes.substr(0, below(bytes.size()));
    case 2:
    case 3:
      return with_value_replaced(bytes, random);
    case 1:
      bytes[below(bytes.size())] = static_cast<char>(below(256));
      return bytes;
    default:
      for (std::size_t k = 0, most = 1 + below(3); k < most; ++k) {
        const std::size_t digit = bytes.find_first_of("0123456789", 20 + below(json_end - 20));
        if (digit < json_end) bytes[digit] = "0123456789-.e,"[below(14)];
      }
      return bytes;
  }
}

TEST(Gltf, AnAccessorThatNothingUsesMayBeOfAnyKind) {
  for (const ordered_json& other : {ordered_json(nullptr), ordered_json(1), ordered_json("")}) {
    MadeGltf made = rich_gltf();
    made.root["accessors"].push_back(other);
    const Gltf file = parsed(made.glb());
    EXPECT_EQ(json_of(bytes_of(file, moved(file, 1)))["accessors"].back(), other);
  }
}

TEST(Gltf, AScenePaysForEachPrimitiveThatItDrawsAndSaysEachThingOnce) {
  MadeGltf made = square();
  const ordered_json points{{"attributes", {{"POSITION", 0}}}, {"mode", 0}};
  const int cloud = made.mesh(std::vector<ordered_json>(1000, points));
  made.root["scenes"][0]["nodes"].push_back(made.node({{"mesh", cloud}}));
  made.root["scenes"][0]["nodes"].push_back(made.node({{"mesh", cloud}}));
  EXPECT_EQ(parsed(made.glb()).notices().size(), 1000U);
  for (int k = 0; k < 998; ++k) made.root["scenes"][0]["nodes"].push_back(made.node({{"mesh", cloud}}));
  EXPECT_EQ(refusal(made), (std::pair<std::string, std::string>("MESH_UNSUPPORTED", "the scene")));
}

TEST(Gltf, BuffersTogetherHoldAsMuchAsAGlb) {
  MadeGltf made = square();
  made.root["buffers"] = {{{"byteLength", made.buffer.size()}}, {{"byteLength", std::uint64_t{1} << 32}}};
  const auto file = Gltf::parse(glb_bytes(made.root.dump(), made.buffer, {}), {});
  EXPECT_EQ(fault_of(file.status()).reason, "MESH_UNSUPPORTED");
  EXPECT_EQ(fault_of(file.status()).element, "buffer 1");
}

TEST(Gltf, DamagedFilesAreRefusedOrReadAndNeverMore) {
  MadeGltf made = rich_gltf();
  made.root["skins"] = {
      {{"joints", {1}}, {"inverseBindMatrices", made.floats(std::vector<float>(16, 1), "MAT4", 16)}}};
  made.node({{"rotation", {0, 0, 0, 1}}, {"scale", {1, 1, 1}}});
  made.node({{"mesh", 0}, {"skin", 0}});
  made.root["scenes"][0]["nodes"] = {0, 1, 2};
  const std::string glb = made.glb();
  std::mt19937 random(20260101);
  int refused = 0, read = 0;
  for (int round = 0; round < 6000; ++round) {
    const auto file = Gltf::parse(damaged(glb, random), {});
    ++(file.ok() ? read : refused);
    if (!file.ok()) {
      EXPECT_FALSE(fault_of(file.status()).element.empty()) << file.status();
      continue;
    }
    if (!deformable(check_mesh(file->mesh())).ok()) continue;
    file->groups();
    for (const Packing packing : {Packing::kGlb, Packing::kGltf}) {
      const auto out = file->bytes(moved(*file, 1), packing, 0.0, true);
      if (!out.ok()) continue;
      const auto again = Gltf::parse(*out, {});
      ASSERT_TRUE(again.ok()) << again.status();
      EXPECT_EQ(again->mesh().faces, file->mesh().faces);
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace lpdeform::gltf
