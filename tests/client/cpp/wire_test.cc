#include "client/cpp/wire.h"

#include <gtest/gtest.h>

#include <set>

#include "client/cpp/status_details.h"
#include "client/cpp/wire_holds.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "tests/support/one_of_each.h"

namespace lpdeform::client {
namespace {

TEST(Packer, KeepsSmallRunsInTheMessageAndUploadsWhatDoesNotFit) {
  std::vector<std::size_t> uploaded;
  Packer packer([&](std::string_view bytes) {
    uploaded.push_back(bytes.size());
    return absl::StatusOr<std::string>("uploads/x");
  });
  v1::Buffer first, second, third;
  ASSERT_TRUE(packer.pack(std::string(Packer::kInlineBytes - 10, 'a'), first).ok());
  ASSERT_TRUE(packer.pack(std::string(20, 'b'), second).ok());
  ASSERT_TRUE(packer.pack(std::string(10, 'c'), third).ok());
  EXPECT_EQ(first.source_case(), v1::Buffer::kInline);
  EXPECT_EQ(second.upload(), "uploads/x");
  EXPECT_EQ(third.source_case(), v1::Buffer::kInline);
  EXPECT_EQ(uploaded, std::vector<std::size_t>{20});
}

TEST(Wire, ASummaryTellsWhatTheSearchForMinimaDid) {
  v1::SolveSummary summary;
  summary.add_minima(4);
  summary.add_minima(3);
  summary.set_further_starts(8);
  summary.set_search_iterations(90);
  summary.set_effort(1);
  SolveResult out;
  from_wire(summary, out);
  EXPECT_EQ(out.minima, (std::vector<double>{4, 3}));
  EXPECT_EQ(out.further_starts, 8u);
  EXPECT_EQ(out.search_iterations, 90u);
  EXPECT_EQ(out.effort, 1u);
}

TEST(Wire, AnUpdateWithoutSettingsChangesNone) {
  Update update;
  update.handles.emplace("tip", Update::Removal{});
  Packer packer([](std::string_view) { return absl::InternalError("not needed"); });
  v1::Update message;
  ASSERT_TRUE(to_wire(update, 9, packer, message).ok());
  EXPECT_EQ(message.input_seq(), 9u);
  EXPECT_FALSE(message.has_settings());
  ASSERT_EQ(message.handles_size(), 1);
  EXPECT_EQ(message.handles(0).change_case(), v1::HandleUpdate::kRemove);
}

TEST(Wire, SaysHowAHandleIsHeldAndWhatMayMove) {
  Update update;
  update.handles.emplace("lock", Handle{.vertices = {7}, .hold = PlaneLock{{0, 1, 2}}});
  update.handles.emplace("points",
                         Handle{.hold = Soft{0}, .points = {{5, {0.5, 0.25, 0.25}}}, .footprint = 3});
  update.settings.region = RegionOfInterest{{4, 5}};
  Packer packer([](std::string_view) { return absl::InternalError("not needed"); });
  v1::Update message;
  ASSERT_TRUE(to_wire(update, 1, packer, message).ok());
  const v1::Handle &lock = message.handles(0).set(), &points = message.handles(1).set();
  EXPECT_EQ(lock.plane_lock().normal().z(), 2);
  EXPECT_FALSE(lock.has_points());
  EXPECT_FALSE(points.has_vertices());
  EXPECT_EQ(points.points().faces().inline_().size(), 4u);
  EXPECT_EQ(points.points().barycentric().inline_().size(), 24u);
  EXPECT_TRUE(points.soft().has_weight());  // 0 is a weight
  EXPECT_EQ(points.footprint_radius(), 3);
  EXPECT_EQ(message.settings().region().vertices().inline_().size(), 8u);

  update.settings.region = RegionOfInterest{};
  v1::Update removing;
  ASSERT_TRUE(to_wire(update, 2, packer, removing).ok());
  EXPECT_TRUE(removing.settings().has_region());
  EXPECT_FALSE(removing.settings().region().has_vertices());
}

TEST(Wire, AResizingAndAutomaticFieldsGoAsTheyAre) {
  Update update;
  update.resize = Resize{.scale = {2, 1, 1}, .origin = {{1, 2, 3}}, .axes = {{{{0, 1, 0}, {0, 0, 1}}}}};
  update.settings.p = Automatic{0.5};
  Packer packer([](std::string_view) { return absl::InternalError("not needed"); });
  v1::Update message;
  ASSERT_TRUE(to_wire(update, 9, packer, message).ok());
  EXPECT_EQ(message.resize().scale().x(), 2);
  EXPECT_EQ(message.resize().origin().z(), 3);
  EXPECT_EQ(message.resize().x_axis().y(), 1);
  EXPECT_EQ(message.resize().y_axis().z(), 1);
  EXPECT_EQ(message.settings().p().automatic().strength(), 0.5);
  v1::Update bare;
  ASSERT_TRUE(to_wire(Update{.resize = Resize{}}, 9, packer, bare).ok());
  EXPECT_FALSE(bare.resize().has_origin() || bare.resize().has_x_axis() || bare.has_settings());
}

TEST(Wire, AFaultOfAStreamKeepsReasonElementAndLimit) {
  v1::Fault fault;
  fault.set_code(3);
  fault.set_reason("P_OUT_OF_RANGE");
  fault.set_text("p is 0.5.");
  fault.set_element("p");
  fault.set_limit("1 <= p <= 64");
  const absl::Status status = from_wire(fault);
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_EQ(fault_of(status), (Fault{"P_OUT_OF_RANGE", "p", "1 <= p <= 64"}));
}

/// A length-delimited protobuf field of less than 128 bytes, written by hand.
std::string field(int number, const std::string& bytes) {
  return std::string{static_cast<char>(number << 3 | 2), static_cast<char>(bytes.size())} + bytes;
}

TEST(StatusDetails, FindsReasonElementAndLimitInAnErrorInfo) {
  const std::string info = field(1, "MESH_NOT_FINITE") + field(2, "lpdeform") +
                           field(3, field(1, "element") + field(2, "vertex 17")) +
                           field(3, field(1, "limit") + field(2, "finite"));
  const std::string details = field(3, field(1, "type.googleapis.com/google.rpc.BadRequest") + field(2, "")) +
                              field(3, field(1, "type.googleapis.com/google.rpc.ErrorInfo") + field(2, info));
  const absl::Status status = with_details(absl::StatusCode::kInvalidArgument, "Vertex 17 is NaN.", details);
  EXPECT_EQ(fault_of(status), (Fault{"MESH_NOT_FINITE", "vertex 17", "finite"}));
  EXPECT_EQ(status.message(), "Vertex 17 is NaN.");
}

TEST(StatusDetails, LeavesOutWhatItCannotRead) {
  const absl::Status status = with_details(absl::StatusCode::kUnavailable, "gone", "\xff\xff\xff");
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_EQ(fault_of(status), Fault{});
}

// The check value of the CRC catalogue, and one of RFC 3720, B.4.
TEST(Crc32c, AgreesWithPublishedValuesAndContinuesOverParts) {
  EXPECT_EQ(crc32c("123456789"), 0xe3069283u);
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8a9136aau);
  EXPECT_EQ(crc32c("456789", crc32c("123")), 0xe3069283u);
  EXPECT_EQ(crc32c(""), 0u);
}

TEST(Wire, EveryKindOfHoldHasAFieldOfItsOwnAndComesBack) {
  std::set<int> fields;
  for (const Hold& hold : one_of_each<Hold>()) {
    v1::Handle message, again;
    to_wire(hold, message);
    EXPECT_TRUE(fields.insert(message.hold_case()).second) << hold.index();
    const Hold back = hold_from_wire(message);
    EXPECT_EQ(back.index(), hold.index());
    to_wire(back, again);
    EXPECT_EQ(again.SerializeAsString(), message.SerializeAsString()) << hold.index();
  }
  const auto* const known = v1::Handle::descriptor()->FindOneofByName("hold");
  EXPECT_EQ(fields.size(), static_cast<std::size_t>(known->field_count()) + 1);  // Exactly has no field
}

TEST(Wire, ChangesOfHandlesComeBackAsTheyWereSent) {
  Update update;
  update.handles.emplace("gone", Update::Removal{});
  update.handles.emplace("moved", Motion(TargetPositions{{1, 2, 3, 4, 5, 6}}));
  update.handles.emplace(
      "turned", Motion(RigidMotion{
                    .axis = {1, 0, 0}, .angle_radians = 0.5, .center = {1, 2, 3}, .translation = {4, 5, 6}}));
  update.handles.emplace("held", Handle{.vertices = {7, 9}, .hold = Soft{0.25}, .footprint = 2});
  update.handles.emplace("rail", Handle{.vertices = {1}, .hold = AxisLock{{0, 1, 0}}});
  update.handles.emplace("plane", Handle{.vertices = {2}, .hold = PlaneLock{{0, 0, 1}}});
  update.handles.emplace("free", Handle{.vertices = {3}, .hold = Orientation{5}});
  update.handles.emplace("points", Handle{.hold = Soft{0}, .points = {{5, {0.5, 0.25, 0.25}}}});
  const auto packer = [] {
    return Packer([](std::string_view) { return absl::InternalError("not needed"); });
  };
  v1::Update first, second;
  Packer one = packer(), other = packer();
  ASSERT_TRUE(to_wire(update, 1, one, first).ok());
  const auto back = from_wire(first.handles());
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_TRUE(to_wire(*back, 1, other, second).ok());
  EXPECT_EQ(first.DebugString(), second.DebugString());
  first.mutable_handles(3)->mutable_move()->mutable_targets()->mutable_positions()->set_inline_("odd");
  EXPECT_TRUE(absl::IsInternal(from_wire(first.handles()).status()));
}

}  // namespace
}  // namespace lpdeform::client
