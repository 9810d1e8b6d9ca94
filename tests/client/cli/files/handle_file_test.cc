#include "client/cli/files/handle_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "client/cli/files/hold_keys.h"
#include "core/base/fault.h"
#include "tests/support/one_of_each.h"

namespace lpdeform::cli {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kVertexCount = 10;

/// The reason, after checking that the message names what it is about.
std::string refusal(std::string_view json, const std::vector<std::string>& named) {
  const auto handles = parse_handles(json, kVertexCount);
  EXPECT_EQ(handles.status().code(), absl::StatusCode::kInvalidArgument) << json;
  for (const std::string& name : named) EXPECT_THAT(std::string(handles.status().message()), HasSubstr(name));
  return fault_of(handles.status()).reason;
}

/// One handle "tip" with these keys after its name.
std::string refusal_of_tip(const std::string& keys, const std::vector<std::string>& named) {
  return refusal(R"({"handles": [{"name": "tip", )" + keys + "}]}", named);
}

TEST(HandleFile, ReadsFixedRigidAndFreeHandles) {
  const auto file = parse_handles(R"({"mesh": "bar.off", "note": "", "handles": [
      {"name": "base", "vertices": [0, 1, 2]},
      {"name": "tip", "vertices": [7, 8], "translate": [0, 0, 1],
       "rotate": {"axis": [0, 0, 1], "angle_degrees": 90, "center": [1, 2, 3]}},
      {"name": "free", "vertices": [9], "positions": [[1, 2, 3]]}]})",
                                  kVertexCount);
  ASSERT_TRUE(file.ok()) << file.status();
  const std::vector<NamedHandle>* const handles = &file->handles;
  ASSERT_EQ(handles->size(), 3u);
  EXPECT_EQ((*handles)[0].handle.vertices, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_TRUE(std::holds_alternative<client::Fixed>((*handles)[0].handle.motion));
  const auto& rigid = std::get<client::RigidMotion>((*handles)[1].handle.motion);
  EXPECT_DOUBLE_EQ(rigid.angle_radians, std::numbers::pi / 2);
  EXPECT_EQ(rigid.center, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(rigid.translation, (std::array<double, 3>{0, 0, 1}));
  EXPECT_EQ(std::get<client::TargetPositions>((*handles)[2].handle.motion).positions,
            (std::vector<double>{1, 2, 3}));
}

TEST(HandleFile, SurvivesAnyDepthOfNesting) {
  const std::string deep = std::string(300'000, '[') + std::string(300'000, ']');
  EXPECT_EQ(refusal(R"({"handles": )" + deep + "}", {}), "HANDLE_FILE_VALUE");
}

TEST(HandleFile, WhatIsWrittenReadsBack) {
  const std::vector<NamedHandle> written{
      {"base", {{0, 1}, client::Fixed{}}},
      {"tip", {{7}, client::RigidMotion{.axis = {0, 1, 0}, .angle_radians = 0.25, .translation = {1, 0, 0}}}},
      {"free", {{9, 3}, client::TargetPositions{{1, 2, 3, 4, 5, 6.5}}}}};
  const auto file = parse_handles(handle_file_text(written, "bar.off", "a note"), kVertexCount);
  ASSERT_TRUE(file.ok()) << file.status();
  const std::vector<NamedHandle>* const read = &file->handles;
  ASSERT_EQ(read->size(), 3u);
  EXPECT_EQ((*read)[2].handle.vertices, written[2].handle.vertices);
  const auto& tip = std::get<client::RigidMotion>((*read)[1].handle.motion);
  EXPECT_NEAR(tip.angle_radians, 0.25, 1e-15);  // through degrees and back
  EXPECT_EQ(tip.axis, (std::array<double, 3>{0, 1, 0}));
  EXPECT_EQ(std::get<client::TargetPositions>((*read)[2].handle.motion).positions,
            (std::vector<double>{1, 2, 3, 4, 5, 6.5}));
}

TEST(HandleFile, ReadsEveryKindOfHandleAndTheRegion) {
  const auto file = parse_handles(R"({"region": [1, 2, 3], "handles": [
      {"name": "soft", "vertices": [0], "soft": 2.5, "footprint": 1.5},
      {"name": "points", "points": [{"face": 4, "barycentric": [0.2, 0.3, 0.5]}], "positions": [[1, 2, 3]]},
      {"name": "turned", "vertices": [1], "orientation": 50, "rotate": {"axis": [0, 0, 1], "angle_degrees": 90}},
      {"name": "rail", "vertices": [2], "axis_lock": [1, 0, 0]},
      {"name": "floor", "vertices": [3], "plane_lock": [0, 1, 0]}]})",
                                  kVertexCount);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->region, (std::vector<std::uint32_t>{1, 2, 3}));
  for (const auto& handles :
       {file->handles, parse_handles(handle_file_text(file->handles, "", ""), kVertexCount)->handles}) {
    EXPECT_EQ(std::get<client::Soft>(handles[0].handle.hold).weight, 2.5);
    EXPECT_EQ(handles[0].handle.footprint, 1.5);
    ASSERT_EQ(handles[1].handle.points.size(), 1u);
    EXPECT_EQ(handles[1].handle.points[0].face, 4u);
    EXPECT_EQ(handles[1].handle.points[0].barycentric, (std::array<double, 3>{0.2, 0.3, 0.5}));
    EXPECT_EQ(std::get<client::Orientation>(handles[2].handle.hold).weight, 50);
    EXPECT_EQ(std::get<client::AxisLock>(handles[3].handle.hold).axis, (std::array<double, 3>{1, 0, 0}));
    EXPECT_EQ(std::get<client::PlaneLock>(handles[4].handle.hold).normal, (std::array<double, 3>{0, 1, 0}));
  }
}

TEST(HandleFile, EveryKindOfHoldIsWrittenUnderItsKeyAndReadsBack) {
  std::size_t key = 0;
  for (const client::Hold& hold : one_of_each<client::Hold>()) {
    const std::string text = handle_file_text({{"tip", {.vertices = {1}, .hold = hold}}}, "", "");
    if (hold.index() > 0) {
      EXPECT_THAT(text, HasSubstr(hold_keys().at(key++)));
    }
    const auto file = parse_handles(text, kVertexCount);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_EQ(file->handles[0].handle.hold.index(), hold.index()) << text;
    EXPECT_EQ(handle_file_text(file->handles, "", ""), text);
  }
  EXPECT_EQ(key, hold_keys().size());
}

TEST(HandleFile, NamesWhatIsWrongWithAKindOfHandle) {
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "soft": -1)", {"soft", "tip"}), "HANDLE_WEIGHT_OUT_OF_RANGE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "soft": true)", {"soft", "tip"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "soft": 1, "axis_lock": [0, 0, 1])", {"tip"}),
            "HANDLE_HOLD_TWICE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "plane_lock": [0, 0, 0])", {"tip"}), "HANDLE_LOCK_DIRECTION");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "footprint": -2)", {"tip"}), "HANDLE_FOOTPRINT_OUT_OF_RANGE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "points": [])", {"tip"}), "HANDLE_POINTS_AND_VERTICES");
  EXPECT_EQ(refusal_of_tip(R"("points": [])", {"tip"}), "HANDLE_EMPTY");
  EXPECT_EQ(refusal_of_tip(R"("points": [{"face": 1, "barycentric": [0.5, 0.6, 0.5]}])", {"tip"}),
            "HANDLE_BARYCENTRIC");
  EXPECT_EQ(refusal_of_tip(R"("points": [{"face": -1, "barycentric": [1, 0, 0]}])", {"tip"}),
            "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal(R"({"region": [], "handles": [{"name": "tip", "vertices": [1]}]})", {"region"}),
            "REGION_EMPTY");
  EXPECT_EQ(refusal(R"({"region": [10], "handles": [{"name": "tip", "vertices": [1]}]})", {"region", "10"}),
            "REGION_VERTEX_OUT_OF_RANGE");
}

TEST(HandleFile, NamesTheLineOfWhatIsNotJson) {
  EXPECT_EQ(refusal("{\"handles\":\n [,]}", {"line 2"}), "HANDLE_FILE_SYNTAX");
  EXPECT_EQ(refusal("", {"line 1"}), "HANDLE_FILE_SYNTAX");
}

TEST(HandleFile, NamesAnUnknownKeyAndItsHandle) {
  EXPECT_EQ(refusal(R"({"handels": []})", {"handels", "handles"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "weight": 2)", {"tip", "weight"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "rotate": {"axis": [0, 0, 1], "angle": 3})", {"tip", "angle"}),
            "HANDLE_FILE_KEY");
}

TEST(HandleFile, NamesAMissingKeyAndOneThatStandsTwice) {
  EXPECT_EQ(refusal(R"({"note": ""})", {"handles"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal(R"({"handles": [{"vertices": [1]}]})", {"handles[0]", "name"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal_of_tip(R"("note": 1)", {"note"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal(R"({"handles": [{"name": "tip"}]})", {"tip", "vertices"}), "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "rotate": {"axis": [0, 0, 1]})", {"tip", "angle_degrees"}),
            "HANDLE_FILE_KEY");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "vertices": [2])", {"vertices", "twice"}), "HANDLE_FILE_KEY");
}

TEST(HandleFile, NamesAValueOfTheWrongKind) {
  EXPECT_EQ(refusal("[]", {"[]"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal(R"({"handles": {}})", {"handles", "{}"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal(R"({"handles": [3]})", {"handles[0]", "3"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal(R"({"handles": [{"name": 4}]})", {"name", "4"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1.5])", {"tip", "1.5"}), "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "translate": [0, 1])", {"tip", "translate", "[0,1]"}),
            "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "translate": [0, 1, "x"])", {"tip", "translate", "\"x\""}),
            "HANDLE_FILE_VALUE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "positions": [1, 2, 3])", {"tip", "positions"}),
            "HANDLE_TARGET_COUNT");
}

TEST(HandleFile, NeedsAtLeastOneHandleWithAVertex) {
  EXPECT_EQ(refusal(R"({"handles": []})", {"no handles"}), "HANDLE_FILE_EMPTY");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [])", {"tip"}), "HANDLE_EMPTY");
}

TEST(HandleFile, NamesTheVertexThatTheMeshDoesNotHave) {
  EXPECT_EQ(refusal_of_tip(R"("vertices": [10])", {"tip", "10", "0 to 9"}), "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [-1])", {"tip", "-1"}), "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [18446744073709551615])", {"tip"}), "HANDLE_VERTEX_OUT_OF_RANGE");
}

TEST(HandleFile, NamesTheVertexThatIsInTwoHandlesAndBothOfThem) {
  EXPECT_EQ(refusal(R"({"handles": [{"name": "a", "vertices": [1, 2]}, {"name": "b", "vertices": [2]}]})",
                    {"Vertex 2", "\"a\"", "\"b\""}),
            "HANDLE_VERTEX_TWICE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1, 1])", {"Vertex 1", "twice in handle \"tip\""}),
            "HANDLE_VERTEX_TWICE");
}

TEST(HandleFile, NamesTheNameThatTwoHandlesHave) {
  EXPECT_EQ(
      refusal(R"({"handles": [{"name": "a", "vertices": [1]}, {"name": "a", "vertices": [2]}]})", {"\"a\""}),
      "HANDLE_NAME_TWICE");
  EXPECT_EQ(refusal(R"({"handles": [{"name": "", "vertices": [1]}]})", {"handles[0]"}), "HANDLE_NAME");
}

TEST(HandleFile, TakesOneKindOfMotion) {
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "positions": [[0, 0, 0]], "translate": [0, 0, 1])",
                           {"tip", "translate"}),
            "HANDLE_MOTION_TWICE");
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1, 2], "positions": [[0, 0, 0]])", {"tip", "1 positions for 2"}),
            "HANDLE_TARGET_COUNT");
}

TEST(HandleFile, RefusesAnAxisWithoutADirection) {
  EXPECT_EQ(refusal_of_tip(R"("vertices": [1], "rotate": {"axis": [0, 0, 0], "angle_degrees": 9})",
                           {"tip", "axis"}),
            "HANDLE_AXIS_ZERO");
}

TEST(HandleFile, SaysWhichFileIsNotThere) {
  const auto handles = read_handles("/nowhere/handles.json", kVertexCount);
  EXPECT_EQ(handles.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(handles.status().message()), HasSubstr("/nowhere/handles.json"));
}

}  // namespace
}  // namespace lpdeform::cli
