#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

const TriangleMesh kTriangle = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1.5, -2e-3}}, {{0, 1, 2}});

void expect_triangle(std::string_view text) {
  const TriangleMesh mesh = parsed(text, MeshFormat::kOff);
  EXPECT_TRUE(same_bits(mesh.vertices, kTriangle.vertices)) << mesh.vertices;
  EXPECT_TRUE(same_faces(mesh.faces, kTriangle.faces)) << mesh.faces;
}

std::string refused(std::string_view text) {
  return refused_at(text, MeshFormat::kOff);
}

TEST(Off, ReadsVerticesAndFaces) {
  expect_triangle("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1.5 -2e-3\n3 0 1 2\n");
}

TEST(Off, ReadsVariantsOfTheHead) {
  expect_triangle("OFF 3 1 0\n0 0 0\n1 0 0\n0 1.5 -2e-3\n3 0 1 2\n");
  expect_triangle("OFF\n3 1\n0 0 0\n1 0 0\n0 1.5 -2e-3\n3 0 1 2");
  expect_triangle("3 1 0\n0 0 0\n1 0 0\n0 1.5 -2e-3\n3 0 1 2\n");
  expect_triangle("\xEF\xBB\xBFOFF\r\n3 1 0\r\n0 0 0\r\n1 0 0\r\n0 1.5 -2e-3\r\n3 0 1 2\r\n");
}

TEST(Off, SkipsCommentsAndEmptyLines) {
  expect_triangle(
      "# made by hand\nOFF # keyword\n\n3 1 0 # counts\n\n0 0 0\n# between\n1 0 0 # x\n\t0 1.5 -2e-3\n\n3 0 "
      "1 2\n");
}

TEST(Off, SkipsColoursNormalsAndTextureCoordinates) {
  expect_triangle(
      "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1.5 -2e-3 0 0 255 255\n3 0 1 2 9 9 9\n");
  expect_triangle("NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1.5 -2e-3 0 0 1\n3 0 1 2\n");
  expect_triangle("STOFF\n3 1 0\n0 0 0 0 0\n1 0 0 1 0\n0 1.5 -2e-3 0 1\n3 0 1 2\n");
  expect_triangle("STCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1 0 0\n1 0 0\n0 1.5 -2e-3\n3 0 1 2\n");
}

TEST(Off, CutsPolygonsIntoFansAndDropsPointsAndLines) {
  const TriangleMesh mesh =
      parsed("OFF\n5 4 0\n0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 1 0\n5 0 1 2 3 4\n2 0 1\n1 3\n0\n", MeshFormat::kOff);
  EXPECT_TRUE(same_faces(mesh.faces, make_mesh({}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}).faces));
}

TEST(Off, ReadsPlusSignsAndNumbersTooSmallForADouble) {
  const TriangleMesh mesh = parsed("OFF\n1 0 0\n1e-999 -0 +1\n", MeshFormat::kOff);
  EXPECT_EQ(mesh.vertices(0, 0), 0);
  EXPECT_EQ(mesh.vertices(0, 2), 1);
}

TEST(Off, NamesACornerWhoseVertexIsNotThereAsTheFileCounts) {
  const std::string vertices = "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  for (const std::string corner : {"3", "-1", "99999999999"}) {
    EXPECT_EQ(refusal_of(vertices + "3 0 1 " + corner + "\n", MeshFormat::kOff),
              "Line 7: face 1 of 2 has the corner " + corner + "; there are 3 vertices, counted from 0.");
  }
}

TEST(Off, NamesAVertexThatIsNotFinite) {
  for (const std::string number : {"nan", "-inf", "1e999"}) {
    EXPECT_EQ(refusal_of("OFF\n2 0 0\n0 0 0\n0 " + number + " 0\n", MeshFormat::kOff),
              "Line 4: vertex 1 of 2 has a NaN or infinite coordinate.");
  }
}

TEST(Off, RefusesWhatIsNoOffFile) {
  EXPECT_EQ(refused(""), "line 1");
  EXPECT_EQ(refused("\n\nply\n"), "line 3");
  EXPECT_EQ(refused("4OFF\n1 0 0\n0 0 0 0\n"), "line 1");
  EXPECT_EQ(refused("OFF BINARY\n"), "line 1");
  EXPECT_EQ(refused("OFF\n3\n"), "line 2");
  EXPECT_EQ(refused("OFF\n-3 1 0\n"), "line 2");
  EXPECT_EQ(refused("OFF\n3 x 0\n"), "line 2");
}

TEST(Off, RefusesTruncatedFilesAtTheirLastLine) {
  const std::string whole = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
  for (std::size_t size = 0; size < whole.size() - 1; ++size) {
    EXPECT_NE(refused(whole.substr(0, size)), "accepted") << size;
  }
  EXPECT_EQ(refused("OFF\n3 1 0\n0 0 0\n1 0\n"), "line 4");
  EXPECT_EQ(refused("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n"), "line 6");
}

TEST(Off, RefusesWordsThatAreNoNumbers) {
  EXPECT_EQ(refused("OFF\n3 1 0\n0 0 0\n1 0,5 0\n0 1 0\n3 0 1 2\n"), "line 4");
  EXPECT_EQ(refused("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2.5\n"), "line 6");
  EXPECT_EQ(refused("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"), "line 6");
}

TEST(Off, AForgedCountCostsNoMemory) {
  EXPECT_EQ(refused("OFF\n2147483647 2147483647 0\n0 0 0\n"), "line 3");
  EXPECT_EQ(refused("OFF\n1 1 0\n0 0 0\n2147483647 0 0 0\n"), "line 4");
}

}  // namespace
}  // namespace lpdeform
