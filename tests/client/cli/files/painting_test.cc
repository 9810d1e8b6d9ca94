#include "client/cli/files/painting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/files/material_input.h"
#include "core/analysis/automatic_material.h"
#include "core/base/fault.h"
#include "core/mesh/weld.h"
#include "tests/core/split_shapes.h"

namespace lpdeform::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Painting, ReadsTheGroupsOfAnObjFile) {
  const auto groups = obj_groups(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
      "g arm hand\nf 1 2 3\nv 1 1 1\nf 2/1 3/2 -1/1/1\n"
      "g leg # a comment\nf 1 \\\n 2 4\ng empty\ng\nf 1 3 4\no whole\nf 2 3 4\n");
  ASSERT_EQ(groups.size(), 4u);
  EXPECT_EQ(groups[0].name, "arm");
  EXPECT_THAT(groups[0].vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(groups[1].name, "hand");
  EXPECT_EQ(groups[1].vertices, groups[0].vertices);
  EXPECT_EQ(groups[2].name, "leg");
  EXPECT_THAT(groups[2].vertices, ElementsAre(0, 1, 3));
  EXPECT_EQ(groups[3].name, "whole");
  EXPECT_TRUE(obj_groups("").empty());
}

TEST(Painting, CoversWhatCameBefore) {
  const std::vector<VertexGroup> groups{{"a", {0, 1}, 1.5, {}}, {"b", {1, 2}, {}, 3.0}};
  PaintedFields fields{{2}, {1}};
  ASSERT_TRUE(paint(groups, {{"b", 4}, {"a", 6}}, {}, 4, fields).ok());
  EXPECT_THAT(fields.p, ElementsAre(6, 6, 4, 2));
  EXPECT_THAT(fields.stiffness, ElementsAre(1, 3, 3, 1));
}

TEST(Painting, LeavesAFieldThatNothingPaints) {
  PaintedFields fields{{2}, {1}};
  ASSERT_TRUE(paint({{"a", {0}, {}, {}}}, {}, {{"a", 5}}, 2, fields).ok());
  EXPECT_THAT(fields.p, ElementsAre(2));
  EXPECT_THAT(fields.stiffness, ElementsAre(5, 1));
}

TEST(Painting, NamesTheGroupsThereAre) {
  PaintedFields fields{{2}, {1}};
  const absl::Status status =
      paint({{"arm", {0}, {}, {}}, {"leg", {1}, {}, {}}}, {{"wing", 1}}, {}, 2, fields);
  EXPECT_EQ(fault_of(status).reason, "GROUP_UNKNOWN");
  EXPECT_THAT(std::string(status.message()), HasSubstr("\"wing\"; there are: arm, leg"));
}

TEST(Painting, ReadsANameAndANumber) {
  EXPECT_EQ(parse_paint("arm=1.5")->group, "arm");
  EXPECT_EQ(parse_paint("a=b=2")->group, "a=b");
  EXPECT_EQ(parse_paint("a=b=2")->value, 2);
  for (const char* text : {"arm", "arm=", "=2", "arm=soft", ""})
    EXPECT_EQ(fault_of(parse_paint(text).status()).reason, "PAINT_SYNTAX") << text;
}

TEST(Painting, ReadsTheGroupsOfAHandleFile) {
  const auto file = parse_handles(
      R"({"handles": [{"name": "all", "vertices": [0]}],
          "groups": [{"name": "belly", "vertices": [1, 2], "p": 1, "stiffness": 5},
                                    {"name": "back", "vertices": [2]}]})",
      3);
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_EQ(file->groups.size(), 2u);
  EXPECT_EQ(file->groups[0].p, 1);
  EXPECT_EQ(file->groups[0].stiffness, 5);
  EXPECT_EQ(file->groups[1].p, std::nullopt);
  EXPECT_TRUE(parse_handles(R"({"handles": [{"name": "all", "vertices": [0]}]})", 3)->groups.empty());
}

TEST(Painting, NamesWhatIsWrongWithAGroup) {
  const auto reason_of = [](const std::string& groups) {
    const std::string handles = R"({"handles": [{"name": "all", "vertices": [0]}], "groups": )";
    return fault_of(parse_handles(handles + groups + "}", 3).status()).reason;
  };
  EXPECT_EQ(reason_of("{}"), "HANDLE_FILE_VALUE");
  EXPECT_EQ(reason_of(R"([{"vertices": [1]}])"), "HANDLE_FILE_KEY");
  EXPECT_EQ(reason_of(R"([{"name": "a", "vertices": []}])"), "HANDLE_EMPTY");
  EXPECT_EQ(reason_of(R"([{"name": "a", "vertices": [3]}])"), "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(reason_of(R"([{"name": "a", "vertices": [1], "q": 1}])"), "HANDLE_FILE_KEY");
  EXPECT_EQ(reason_of(R"([{"name": "a", "vertices": [1], "p": "soft"}])"), "HANDLE_FILE_VALUE");
  EXPECT_EQ(reason_of(R"([{"name": "a", "vertices": [1]}, {"name": "a", "vertices": [2]}])"),
            "HANDLE_NAME_TWICE");
}

TEST(Painting, GivesAllCopiesOfAVertexTheSameWhereTheyAreWelded) {
  const TriangleMesh mesh = necked_bar(4, 20, 2, 4);
  const AnyMeshFile split{{split_at_every_corner(mesh), ""}, {}};
  const Weld weld = weld_by_position(split.mesh.vertices).value();
  MaterialOptions options;
  options.automatic = 1;
  client::Settings settings;
  ASSERT_TRUE(read_material(options, split, {{"one copy", {7}, 1.25, {}}}, 0.0, settings).ok());
  const auto& p = std::get<std::vector<double>>(*settings.p);
  const auto& stiffness = std::get<std::vector<double>>(*settings.stiffness);
  ASSERT_EQ(p.size(), static_cast<std::size_t>(split.mesh.vertices.rows()));
  const Field joint_stiffness =
      automatic_material(*RestShape::create(welded(split.mesh, weld)).value(), 1).value().stiffness;
  for (std::size_t copy = 0; copy < p.size(); ++copy) {
    const std::int32_t vertex = weld.to_welded[copy];
    EXPECT_EQ(p[copy], p[weld.first_copy[vertex]]);
    EXPECT_EQ(p[copy] == 1.25, vertex == weld.to_welded[7]);
    EXPECT_EQ(stiffness[copy], joint_stiffness[vertex]);
  }
}

TEST(MaterialOptions, TakePAsANumberOrAsAuto) {
  MaterialOptions options;
  EXPECT_TRUE(parse_p("1.5", options));
  EXPECT_EQ(options.p, 1.5);
  EXPECT_TRUE(parse_p("auto", options));
  EXPECT_EQ(options.automatic, 1);
  EXPECT_TRUE(parse_p("auto:0.25", options));
  EXPECT_EQ(options.automatic, 0.25);
  for (const char* text :
       {"0.5", "65", "autos", "auto:", "auto:2", "auto:-1", "auto:x", "", "nan", "auto:nan"})
    EXPECT_FALSE(parse_p(text, options)) << text;
}

}  // namespace
}  // namespace lpdeform::cli
