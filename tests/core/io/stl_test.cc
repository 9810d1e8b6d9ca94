#include "core/io/byte_order.h"
#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

std::string refused(std::string_view bytes) {
  return refused_at(bytes, MeshFormat::kStl);
}

using Corners = std::array<std::array<float, 3>, 3>;

std::string binary(const std::vector<Corners>& faces, std::uint32_t claimed, std::string head = "") {
  head.resize(80, ' ');
  append_little_endian(head, claimed);
  for (const Corners& face : faces) {
    head.append(12, '\x7f');
    for (const auto& corner : face) {
      for (const float coordinate : corner) append_little_endian(head, coordinate);
    }
    head.append(2, '\0');
  }
  return head;
}

std::string facet(std::string_view a, std::string_view b, std::string_view c) {
  std::string text = "facet normal 0 0 1\nouter loop\n";
  for (const std::string_view corner : {a, b, c}) text += "vertex " + std::string(corner) + "\n";
  return text + "endloop\nendfacet\n";
}

const std::vector<Corners> kSquare{{{{1, 1, 0}, {0, 0, 0}, {1, 0, 0}}},
                                   {{{0, 0, -0.f}, {1, 1, 0}, {0, 1, 0}}}};
const TriangleMesh kWelded = make_mesh({{1, 1, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {1, 0, 3}});

void expect_welded(std::string_view bytes) {
  const TriangleMesh mesh = parsed(bytes, MeshFormat::kStl);
  EXPECT_TRUE(same_bits(mesh.vertices, kWelded.vertices)) << mesh.vertices;
  EXPECT_TRUE(same_faces(mesh.faces, kWelded.faces)) << mesh.faces;
}

TEST(Stl, WeldsBinaryCornersInOrderOfFirstAppearance) {
  expect_welded(binary(kSquare, 2));
}

TEST(Stl, ABinaryFileMayStartWithSolid) {
  expect_welded(binary(kSquare, 2, "solid block"));
}

TEST(Stl, ABinaryFileMayHaveBytesBehindItsFaces) {
  expect_welded(binary(kSquare, 2) + "rest");
}

TEST(Stl, WeldsAsciiCornersInOrderOfFirstAppearance) {
  expect_welded("solid a b\n" + facet("1 1 0", "0 0 0", "1.0 0 0e9") + facet("0 -0 0", "1e0 1 0", "0 1 .0") +
                "endsolid a b\n");
}

TEST(Stl, ReadsUpperCaseAndSeveralSolids) {
  std::string text = "SOLID one\n" + facet("1 1 0", "0 0 0", "1 0 0") + "ENDSOLID one\nsolid\n" +
                     facet("0 0 0", "1 1 0", "0 1 0") + "endsolid\n";
  for (const char* word : {"facet", "loop", "vertex"}) {
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word)) {
      text[at] = static_cast<char>(text[at] - 'a' + 'A');
    }
  }
  expect_welded(text);
}

TEST(Stl, DoesNotWeldWhatIsOnlyNear) {
  const float near_zero = 1e-38f;
  const TriangleMesh mesh =
      parsed(binary({{{{0, 0, 0}, {near_zero, 0, 0}, {0, 1, 0}}}}, 1), MeshFormat::kStl);
  EXPECT_EQ(mesh.vertices.rows(), 3);
}

TEST(Stl, KeepsFacesWithoutArea) {
  const TriangleMesh mesh = parsed(binary({{{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}}}}, 1), MeshFormat::kStl);
  EXPECT_EQ(mesh.faces.rows(), 1);
  EXPECT_EQ(mesh.faces(0, 0), mesh.faces(0, 1));
}

TEST(Stl, NamesAFaceThatIsNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string bytes =
      binary({{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{0, 0, 0}, {0, 0, 1}, {nan, 1, 0}}}}, 2);
  EXPECT_EQ(refusal_of(bytes, MeshFormat::kStl),
            "Byte 134: face 1, counted from 0, has a NaN or infinite coordinate.");
  EXPECT_EQ(refusal_of("solid a\n" + facet("0 0 0", "1 0 0", "0 inf 0") + "endsolid\n", MeshFormat::kStl),
            "Line 6: the vertex has a NaN or infinite coordinate.");
}

TEST(Stl, RefusesBinaryFilesThatEndEarly) {
  EXPECT_EQ(refused(""), "byte 0");
  EXPECT_EQ(refused(binary({}, 0).substr(0, 83)), "byte 83");
  const std::string whole = binary(kSquare, 2);
  EXPECT_EQ(refused(whole.substr(0, whole.size() - 1)), "byte " + std::to_string(whole.size() - 1));
  EXPECT_EQ(refused(binary(kSquare, 4294967295u)), "byte " + std::to_string(whole.size())) << "forged count";
}

TEST(Stl, RefusesAsciiFilesThatMakeNoSense) {
  const std::string face = facet("1 1 0", "0 0 0", "1 0 0");
  EXPECT_EQ(refused("solid a\n" + face), "line 8");
  EXPECT_EQ(refused("solid a\nfacet normal 0 0 1\nvertex 0 0 0\n"), "line 3");
  EXPECT_EQ(refused("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n"),
            "line 6");
  EXPECT_EQ(refused("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n"), "line 4");
  EXPECT_EQ(refused("solid a\n" + face + "nonsense\nendsolid\n"), "line 9");
  EXPECT_EQ(refused("solid a\n" + face + "endsolid\n" + face), "line 10");
  for (std::size_t size = 5; size < face.size(); ++size) {
    EXPECT_NE(refused("solid a\n" + face.substr(0, size)), "accepted") << size;
  }
}

}  // namespace
}  // namespace lpdeform
