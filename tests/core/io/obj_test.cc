#include <clocale>

#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

std::string refused(std::string_view text) {
  return refused_at(text, MeshFormat::kObj);
}

std::string words_of(std::string_view text) {
  return refusal_of(text, MeshFormat::kObj);
}

Faces faces_of(std::string_view text) {
  return parsed(text, MeshFormat::kObj).faces;
}

constexpr std::string_view kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string square_with(std::string_view lines) {
  return std::string(kSquare) + std::string(lines);
}

const Faces kFan = make_mesh({}, {{0, 1, 2}, {0, 2, 3}}).faces;

TEST(Obj, ReadsCornersOfEveryForm) {
  EXPECT_TRUE(same_faces(faces_of(square_with("f 1 2 3 4\n")), kFan));
  EXPECT_TRUE(same_faces(faces_of(square_with("vt 0 0\nf 1/1 2/1 3/1 4/1\n")), kFan));
  EXPECT_TRUE(same_faces(faces_of(square_with("vn 0 0 1\nf 1//1 2//1 3//1 4//1\n")), kFan));
  EXPECT_TRUE(same_faces(faces_of(square_with("vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n")), kFan));
}

TEST(Obj, CountsNegativeIndicesBackFromTheNewestVertex) {
  EXPECT_TRUE(same_faces(faces_of(square_with("f -4 -3 -2 -1\n")), kFan));
  const Faces faces = faces_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -4/7/-1 -2 -1\n");
  EXPECT_TRUE(same_faces(faces, kFan));
}

TEST(Obj, AFaceMayNameVerticesThatComeAfterIt) {
  const Faces faces = faces_of("v 0 0 0\nf 1 2 3 4\nv 1 0 0\nv 1 1 0\nv 0 1 0\n");
  EXPECT_TRUE(same_faces(faces, kFan));
}

TEST(Obj, NamesACornerWhoseVertexIsNotThereAsTheFileCounts) {
  EXPECT_EQ(words_of(square_with("f 1 2 3\n\nf 1 2 9/1\n")),
            "Line 7: face 2 has the corner \"9\"; there are 4 vertices.");
  EXPECT_EQ(words_of(square_with("f 1 2 \\\n99999999999\n")),
            "Line 6: face 1 has the corner \"99999999999\"; there are 4 vertices.");
  EXPECT_EQ(words_of("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n"),
            "Line 3: face 1 has the corner \"-3\"; 2 vertices come before it.");
}

TEST(Obj, NamesAVertexThatIsNotFiniteAsTheFileCounts) {
  EXPECT_EQ(words_of("v 0 0 0\n# one\nv 1 nan 0\n"), "Line 3: vertex 2 has a NaN or infinite coordinate.");
  EXPECT_EQ(refused("v 1 1e999 0\n"), "line 1");
}

TEST(Obj, SkipsNumbersAfterTheThirdOfAVertex) {
  const TriangleMesh mesh = parsed("v 1 2 3 0.5 nan nan\nv 4 5 6 1.0\n", MeshFormat::kObj);
  EXPECT_TRUE(same_bits(mesh.vertices, make_mesh({{1, 2, 3}, {4, 5, 6}}, {}).vertices));
}

TEST(Obj, JoinsLinesThatEndInABackslash) {
  const TriangleMesh mesh =
      parsed("v 0 0 \\\n0\nv 1 0\\\r\n 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n 3\\\n 4\n", MeshFormat::kObj);
  EXPECT_EQ(mesh.vertices.rows(), 4);
  EXPECT_TRUE(same_faces(mesh.faces, kFan));
}

TEST(Obj, LinesMayEndInCarriageReturnsAlone) {
  const std::string text = "# a\rv 0 0 0\rv 1 0 0 # b\rv 1 1 \\\r 0\rv 0 1 0\rf 1 2 3 4\r";
  const absl::StatusOr<MeshFile> file = parse_mesh(text, MeshFormat::kObj);
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(same_faces(file->mesh.faces, kFan));
  EXPECT_EQ(obj_text(*file, 2 * file->mesh.vertices),
            "# a\rv 0 0 0\rv 2 0 0 # b\rv 2 2 0\rv 0 2 0\rf 1 2 3 4\r");
  EXPECT_EQ(words_of("v 0 0 0\r\rv 1 0\r"), "Line 3: vertex 2 needs three numbers.");
}

TEST(Obj, SkipsCommentsAndEverythingElse) {
  EXPECT_TRUE(
      same_faces(faces_of(square_with("# f 1 2 3\ng a b\no thing\ns off\nusemtl red\nmtllib x.mtl\nl 1 2\n"
                                      "vp 1\n\n  f 1 2 3 4 # the face\n")),
                 kFan));
}

TEST(Obj, ReadsNumbersTheSameInEveryLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "C.UTF-8"})
    std::setlocale(LC_ALL, name);
  EXPECT_EQ(parsed("v 0.5 1e-3 -7.25\n", MeshFormat::kObj).vertices(0, 2), -7.25);
  std::setlocale(LC_ALL, before.c_str());
}

TEST(Obj, RefusesLinesThatMakeNoSense) {
  EXPECT_EQ(refused("v 0 0\n"), "line 1");
  EXPECT_EQ(refused("v 0 0 0\nv 0 zero 0\n"), "line 2");
  EXPECT_EQ(refused(square_with("f 1 2\n")), "line 5");
  EXPECT_EQ(refused(square_with("f\n")), "line 5");
  EXPECT_EQ(refused(square_with("\nf 1 2 x\n")), "line 6");
  EXPECT_EQ(refused(square_with("f 1 2 /3\n")), "line 5");
  EXPECT_EQ(refused(std::string("v 0 0 0\n\0", 9)), "byte 8");
}

TEST(Obj, RefusalsNameTheVertexOrFaceAsTheFileCountsThem) {
  EXPECT_EQ(words_of("v 0 0 0\n\nv 0 zero 0\n"), "Line 3: vertex 2 needs three numbers.");
  EXPECT_EQ(words_of("v 0 0 0\nv 0 nan 0\n"), "Line 2: vertex 2 has a NaN or infinite coordinate.");
  const auto second_face = [](const std::string& corners) {
    return words_of(square_with("f 1 2 3 4\n" + corners));
  };
  EXPECT_EQ(second_face("f 1 2\n"), "Line 6: face 2 needs at least three corners.");
  EXPECT_EQ(second_face("f 1 x 3\n"),
            "Line 6: face 2 has a corner that does not start with a vertex number.");
  EXPECT_EQ(second_face("f 1 0 3\n"), "Line 6: face 2 names vertex 0, and the first vertex is 1.");
}

TEST(Obj, AnEmptyTextIsAnEmptyMesh) {
  EXPECT_EQ(parsed("", MeshFormat::kObj).vertices.rows(), 0);
}

constexpr std::string_view kDressed =
    "# two materials\r\nmtllib dress.mtl\no body\nv 0 0 0 0.1 0.2 0.3\n v\t1 0  0\nvt 0.25 0.75\nv 1 1 \\\n "
    "0 # corner\n"
    "v 0 1 0\nvn 0 0 1\ng front\nusemtl red\ns 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nusemtl blue\nf -4//1 -2//1 "
    "-1//1";

TEST(Obj, OutputKeepsEveryLineButTheCoordinates) {
  const absl::StatusOr<MeshFile> file = parse_mesh(kDressed, MeshFormat::kObj);
  ASSERT_TRUE(file.ok());
  const Points moved = make_mesh({{1.5, 2, 3}, {4, 0.1, 6}, {7, 8, -9}, {1e-300, 11, 12}}, {}).vertices;
  EXPECT_EQ(
      obj_text(*file, moved),
      "# two materials\r\nmtllib dress.mtl\no body\nv 1.5 2 3 0.1 0.2 0.3\n v\t4 0.1 6\nvt 0.25 0.75\nv 7 8 "
      "-9 # "
      "corner\nv 1e-300 11 12\nvn 0 0 1\ng front\nusemtl red\ns 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nusemtl blue\n"
      "f -4//1 -2//1 -1//1");
}

TEST(Obj, OutputReadsBackToTheSameBitsAndFaces) {
  const absl::StatusOr<MeshFile> file = parse_mesh(kDressed, MeshFormat::kObj);
  ASSERT_TRUE(file.ok());
  const Points moved =
      make_mesh({{1.0 / 3, 2e300, -0.0}, {4.9e-324, 0.1, 6}, {7, M_PI, -9}, {1e-17, 11, 12}}, {}).vertices;
  const TriangleMesh back = parsed(obj_text(*file, moved), MeshFormat::kObj);
  EXPECT_TRUE(same_bits(back.vertices, moved));
  EXPECT_TRUE(same_faces(back.faces, file->mesh.faces));
}

TEST(Obj, OutputOfAnotherFormatIsPlain) {
  const MeshFile file{make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 2, 1}}), ""};
  EXPECT_EQ(obj_text(file, file.mesh.vertices), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n");
}

}  // namespace
}  // namespace lpdeform
