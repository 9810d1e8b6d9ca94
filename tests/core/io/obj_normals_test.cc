#include "core/io/obj_normals.h"

#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

MeshFile obj(std::string_view text) {
  return parse_mesh(text, MeshFormat::kObj).value();
}

/// Two squares at a right angle, each with the normal of its plane, on one common edge: a hard one.
constexpr std::string_view kCorner =
    "# a corner\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n"
    "vt 0 0\nvn 0 0 1\nvn 0 1 0\ng one\nusemtl red\nf 1/1/1 2/1/1 3/1/1 4/1/1\ns off\nf 2//2 1//-1 5//2 6//2 "
    "# two\n";

Points turned(const Points& points) {  // a quarter turn about x: y to z
  Points result = points;
  result.col(1) = -points.col(2);
  result.col(2) = points.col(1);
  return result;
}

/// The normal at each corner of each face.
std::vector<std::array<double, 3>> corner_normals(const std::string& text) {
  std::vector<std::array<double, 3>> normals, corners;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "vn") {
      std::array<double, 3> n{};
      words >> n[0] >> n[1] >> n[2];
      normals.push_back(n);
    }
    while (word == "f" && words >> line && line[0] != '#')
      corners.push_back(normals.at(std::stoul(line.substr(line.rfind('/') + 1)) - 1));
  }
  return corners;
}

using testing::AnyOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::vector<std::array<double, 3>> part(const std::vector<std::array<double, 3>>& all, std::size_t begin,
                                        std::size_t end) {
  return {all.begin() + static_cast<std::ptrdiff_t>(begin), all.begin() + static_cast<std::ptrdiff_t>(end)};
}

TEST(ObjNormals, TurnWithTheSurfaceAndKeepAHardEdgeHard) {
  const MeshFile file = obj(kCorner);
  const auto at_rest = corner_normals(obj_text_with_normals(file, file.mesh.vertices, std::nullopt));
  ASSERT_EQ(at_rest.size(), 8u);
  EXPECT_THAT(part(at_rest, 0, 4), Each(ElementsAre(0, 0, 1)));
  EXPECT_THAT(part(at_rest, 4, 8), Each(ElementsAre(0, 1, 0)));
  const auto moved = corner_normals(obj_text_with_normals(file, turned(file.mesh.vertices), std::nullopt));
  for (const auto& normal : part(moved, 0, 4)) EXPECT_NEAR(normal[1], -1, 1e-6);
  for (const auto& normal : part(moved, 4, 8)) EXPECT_NEAR(normal[2], 1, 1e-6);
}

TEST(ObjNormals, KeepEverythingElseOfTheSource) {
  const MeshFile file = obj(kCorner);
  const std::string text = obj_text_with_normals(file, 2 * file.mesh.vertices, std::nullopt);
  for (const char* kept : {"# a corner\nmtllib x.mtl\n", "v 2 2 0\n", "vt 0 0\n", "g one\nusemtl red\n",
                           "f 1/1/1 2/1/2 3/1/3 4/1/4\ns off\nf 2//5 1//6 5//7 6//8 # two\n"}) {
    EXPECT_THAT(text, HasSubstr(kept));
  }
  const MeshFile again = obj(text);
  EXPECT_TRUE(same_bits(again.mesh.vertices, 2 * file.mesh.vertices));
  EXPECT_TRUE(same_faces(again.mesh.faces, file.mesh.faces));
}

TEST(ObjNormals, HaveTheLineEndsOfTheSource) {
  for (const std::string& end : {std::string("\n"), std::string("\r\n"), std::string("\r")}) {
    const std::string source = absl::StrReplaceAll(std::string(kCorner), {{"\n", end}});
    const MeshFile file = obj(source);
    ASSERT_GT(file.mesh.faces.rows(), 0);
    const std::string text = obj_text_with_normals(file, 2 * file.mesh.vertices, std::nullopt);
    EXPECT_THAT(absl::StrReplaceAll(text, {{end, ""}}), Not(AnyOf(HasSubstr("\n"), HasSubstr("\r"))));
    EXPECT_THAT(text, HasSubstr(absl::StrCat(end, "vn ")));
  }
}

TEST(ObjNormals, OfCornersWithoutOneAreSmooth) {
  std::string text(kCorner);
  for (const char* of : {"/1/1", "//2", "//-1"}) {
    for (std::size_t at; (at = text.find(of)) != std::string::npos;)
      text.erase(at, std::string_view(of).size());
  }
  const MeshFile file = obj(text);
  const std::string with = obj_text_with_normals(file, file.mesh.vertices, std::nullopt);
  EXPECT_THAT(with, HasSubstr("f 1//1 2//2 3//3 4//4\n"));
  const auto normals = corner_normals(with);
  EXPECT_EQ(normals[0], normals[5]) << "vertex 1 has one normal on both sides of the edge";
  EXPECT_NEAR(normals[0][1], std::sqrt(0.5), 1e-6);
}

TEST(ObjNormals, DoNotShowASeamOfVerticesAtOnePosition) {
  // Two squares in one plane that share no vertex, bent along their common edge afterwards.
  const MeshFile file =
      obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 0\nv 1 -1 0\nv 1 0 0\nv 0 0 0\n"
          "vn 0 0 1\nf 1//1 2//1 3//1 4//1\nf 5//1 6//1 7//1 8//1\n");
  Points bent = file.mesh.vertices;
  bent(4, 2) = bent(5, 2) = 0.5;
  const auto apart = corner_normals(obj_text_with_normals(file, bent, std::nullopt));
  EXPECT_NE(apart[0], apart[7]);
  const auto welded = corner_normals(obj_text_with_normals(file, bent, 0.0));
  EXPECT_EQ(welded[0], welded[7]);
  EXPECT_EQ(welded[1], welded[6]);
}

TEST(ObjNormals, ThatAreMissingOrNoNumbersAreSmooth) {
  const MeshFile file = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 1\nvn x\nf 1//1 2//9 3//2\n");
  const auto normals = corner_normals(obj_text_with_normals(file, file.mesh.vertices, std::nullopt));
  EXPECT_THAT(normals, Each(ElementsAre(0, 0, 1)));
  EXPECT_THAT(obj_text_with_normals(file, file.mesh.vertices, std::nullopt), Not(HasSubstr("vn nan")));
}

TEST(ObjNormals, ComeWithMeshesOfOtherFormatsToo) {
  const MeshFile file{make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}), ""};
  EXPECT_EQ(obj_text_with_normals(file, file.mesh.vertices, std::nullopt),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//3\n");
}

}  // namespace
}  // namespace lpdeform
