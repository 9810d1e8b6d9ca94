// Errors that callers of the C interface may make, without a server.

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "client/c/changes.h"
#include "client/c/error.h"
#include "client/c/lpdeform.h"
#include "client/c/structs.h"
#include "client/c/vertex_source.h"
#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

using testing::ElementsAre;
using testing::EndsWith;

/// What lpdeform_options may be in a later release.
struct LaterOptions {
  lpdeform_options known;
  std::uint64_t unknown;
};

TEST(Structs, ALaterCallersStructIsTakenUnlessItSetsWhatIsUnknown) {
  LaterOptions later{};
  later.known.struct_size = sizeof later;
  later.known.credit = 3;
  EXPECT_EQ(read_struct(&later.known, "options").value().credit, 3);
  later.unknown = 1;
  EXPECT_EQ(fault_of(read_struct(&later.known, "options").status()).reason, "STRUCT_TOO_NEW");
}

TEST(Structs, AnEarlierCallersStructIsTakenWithZeroForWhatItDoesNotHave) {
  lpdeform_update earlier{};
  earlier.struct_size = offsetof(lpdeform_update, begins_step);
  earlier.move_count = 2;
  earlier.begins_step = earlier.reserved = 77;  // somebody else's memory
  const auto read = read_struct(&earlier, "update");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->move_count, 2);
  EXPECT_EQ(read->begins_step, 0);
  EXPECT_EQ(read->reserved, 0);
  earlier.struct_size -= 8;
  EXPECT_EQ(fault_of(read_struct(&earlier, "update").status()).limit, "struct_size >= 48");
}

TEST(Structs, AStructWithoutItsSizeIsRefused) {
  const lpdeform_options none{};
  EXPECT_EQ(fault_of(read_struct(&none, "options").status()).reason, "STRUCT_SIZE");
  EXPECT_EQ(fault_of(read_struct<lpdeform_options>(nullptr, "options").status()).reason, "ARGUMENT_MISSING");
}

TEST(Structs, AnEarlierCallersStructIsNotWrittenBeyond) {
  lpdeform_frame out{};
  out.struct_size = offsetof(lpdeform_frame, epoch);
  out.epoch = 77;
  lpdeform_frame from{};
  from.frame_seq = 5;
  from.epoch = 6;
  write_struct(from, &out);
  EXPECT_EQ(out.frame_seq, 5);
  EXPECT_EQ(out.epoch, 77);
  EXPECT_EQ(out.struct_size, offsetof(lpdeform_frame, epoch));
}

TEST(Errors, KeepReasonElementAndLimit) {
  lpdeform_error error{};
  error.struct_size = sizeof error;
  const absl::Status status =
      carry_fault(absl::StatusCode::kInvalidArgument, {"A_REASON", "vertex 3", "vertex < 2"}, "A text.");
  EXPECT_EQ(tell(status, &error), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error.reason, "A_REASON");
  EXPECT_STREQ(error.element, "vertex 3");
  EXPECT_STREQ(error.limit, "vertex < 2");
  EXPECT_STREQ(error.message, "A text.");
  EXPECT_EQ(tell(absl::OkStatus(), &error), LPDEFORM_OK);
  EXPECT_STREQ(error.message, "");
}

TEST(Errors, ALongTextIsCutBetweenCharacters) {
  std::string text;
  while (text.size() < 600) text += "\xC3\xA4";  // two bytes each
  lpdeform_error error{};
  error.struct_size = sizeof error;
  tell(absl::InternalError(text), &error);
  const std::string said = error.message;
  EXPECT_THAT(said, EndsWith("\xC3\xA4..."));
  EXPECT_GE(said.size(), sizeof error.message - 2);
}

TEST(MeshInput, ReadsInterleavedVerticesAndTurnsTriangles) {
  struct Vertex {
    float texture[2];
    float at[3];
  };
  const std::array<Vertex, 3> vertices{{{{9, 9}, {0, 0, 0}}, {{9, 9}, {1, 0, 0}}, {{9, 9}, {0, 2, 0}}}};
  const std::array<std::uint16_t, 3> indices{0, 1, 2};
  lpdeform_mesh mesh{};
  mesh.vertex_count = 3;
  mesh.positions = {vertices.data(), sizeof vertices,  offsetof(Vertex, at),
                    sizeof(Vertex),  LPDEFORM_FLOAT32, 0};
  mesh.indices = indices.data();
  mesh.index_count = 3;
  mesh.index_format = LPDEFORM_UINT16;
  lpdeform_options options{};
  options.winding = LPDEFORM_CLOCKWISE;
  const client::Mesh read = read_mesh(mesh, Space::of(options).value()).value();
  EXPECT_THAT(read.vertices, ElementsAre(0, 0, 0, 1, 0, 0, 0, 2, 0));
  EXPECT_THAT(read.faces, ElementsAre(0, 2, 1));
}

std::string refused(const lpdeform_mesh& mesh) {
  return fault_of(read_mesh(mesh, Space()).status()).reason;
}

TEST(MeshInput, BuffersAreNeverReadBeyond) {
  const std::array<float, 9> positions{};
  const std::array<std::uint32_t, 3> indices{};
  lpdeform_mesh mesh{};
  mesh.vertex_count = 3;
  EXPECT_EQ(refused(mesh), "ARGUMENT_MISSING");
  mesh.positions = {positions.data(), sizeof positions, 0, 0, LPDEFORM_FLOAT32, 0};
  EXPECT_EQ(refused(mesh), "");
  mesh.vertex_count = 4;
  EXPECT_EQ(refused(mesh), "BUFFER_TOO_SMALL");
  mesh.vertex_count = 3;
  mesh.positions.format = LPDEFORM_RGBA8;
  EXPECT_EQ(refused(mesh), "FORMAT_UNKNOWN");
  mesh.positions.format = LPDEFORM_FLOAT32;
  mesh.indices = indices.data();
  mesh.index_count = 2;
  EXPECT_EQ(refused(mesh), "INDEX_COUNT");
}

TEST(Changes, AQuaternionIsARotation) {
  lpdeform_motion motion{};
  motion.kind = LPDEFORM_RIGID;
  motion.rotation[1] = 2 * std::sin(0.3);  // of length 2
  motion.rotation[3] = 2 * std::cos(0.3);
  motion.translation[0] = 100;
  lpdeform_options options{};
  options.units_per_metre = 100;
  const auto rigid = std::get<client::RigidMotion>(read_motion(motion, Space::of(options).value()).value());
  EXPECT_THAT(rigid.axis, ElementsAre(0, 1, 0));
  EXPECT_NEAR(rigid.angle_radians, 0.6, 1e-15);
  EXPECT_THAT(rigid.translation, ElementsAre(1, 0, 0));
}

TEST(Changes, AnUpdateNamesAHandleOnce) {
  const std::array<std::uint32_t, 1> vertices{0};
  lpdeform_handle handle{};
  handle.struct_size = sizeof handle;
  handle.name = "tip";
  handle.vertices = vertices.data();
  handle.vertex_count = 1;
  const char* const removal = "tip";
  lpdeform_update update{};
  update.struct_size = sizeof update;
  update.sets = &handle;
  update.set_count = 1;
  EXPECT_EQ(read_update(update, Space()).value().handles.size(), 1);
  update.removals = &removal;
  update.removal_count = 1;
  const Fault fault = fault_of(read_update(update, Space()).status());
  EXPECT_EQ(fault.reason, "HANDLE_CHANGED_TWICE");
  EXPECT_EQ(fault.element, "handle \"tip\"");
}

TEST(Changes, SettingsThatAreZeroAreLeftAlone) {
  lpdeform_settings settings{};
  settings.stiffness = 3;
  const client::Settings read = read_settings(settings, Space()).value();
  EXPECT_FALSE(read.p || read.solver || read.region || read.length_unit);
  EXPECT_EQ(std::get<double>(*read.stiffness), 3);
}

TEST(Changes, HowFarToLookForLowerMinimaIsTheServersUnlessItIsSet) {
  lpdeform_settings settings{};
  settings.struct_size = sizeof settings;
  settings.set_solver = settings.search_shows = 1;
  settings.search_effort = 3;
  settings.search_least_share = 0.1;
  EXPECT_FALSE(read_settings(settings, Space())->solver->search);
  settings.set_search = 1;
  const client::MinimaSearch read = read_settings(settings, Space())->solver->search.value();
  EXPECT_EQ(read.effort, 3u);
  EXPECT_TRUE(read.show);
  EXPECT_EQ(read.least_share, 0.1);
  settings.struct_size = offsetof(lpdeform_settings, set_search);  // of a caller that does not know it
  EXPECT_EQ(read_struct(&settings, "settings")->set_search, 0u);
}

TEST(Changes, TheEffortOfASearchIsTheServersUnlessItIsSetAndNoneAtMinusOne) {
  lpdeform_settings settings{};
  settings.set_solver = settings.set_search = settings.search_shows = 1;
  const auto read = [&] { return read_settings(settings, Space())->solver->search.value(); };
  EXPECT_TRUE(read().show);
  EXPECT_FALSE(read().effort);
  settings.search_effort = -1;
  EXPECT_EQ(read().effort, 0u);
  settings.search_effort = -2;
  const Fault fault = fault_of(read_settings(settings, Space()).status());
  EXPECT_EQ(fault.reason, "EFFORT_OUT_OF_RANGE");
  EXPECT_EQ(fault.limit, "-1 <= search_effort <= 1000");
}

TEST(MeshInput, ExtentsAreComparedBeyond32Bits) {
  const Fault fault = fault_of(check_extent("positions", 100, 0xffffffff, 0xffffffff, 12, 0xffffffff));
  EXPECT_EQ(fault.reason, "BUFFER_TOO_SMALL");
  EXPECT_EQ(fault.limit, "bytes >= 18446744065119617037");  // (2^32 - 1) + (2^32 - 2)(2^32 - 1) + 12
}

TEST(Structs, ReservedFieldsAreZero) {
  const std::array<float, 9> positions{};
  lpdeform_mesh mesh{};
  mesh.vertex_count = 3;
  mesh.positions = {positions.data(), sizeof positions, 0, 0, LPDEFORM_FLOAT32, 1};
  EXPECT_EQ(refused(mesh), "RESERVED_SET");
  mesh.positions.reserved = 0;
  mesh.reserved = 1;
  EXPECT_EQ(refused(mesh), "RESERVED_SET");
  lpdeform_settings settings{};
  settings.reserved_too = 1;
  EXPECT_EQ(fault_of(read_settings(settings, Space()).status()).reason, "RESERVED_SET");
  const lpdeform_point point{0, 1, {1, 0, 0}};
  lpdeform_handle handle{};
  handle.name = "tip";
  handle.points = &point;
  handle.point_count = 1;
  EXPECT_EQ(fault_of(read_handle(handle, Space()).status()).element, "points[0]");
}

TEST(Border, CertificatesThatAreNoneAreSaidAtOnce) {
  lpdeform_error error{};
  error.struct_size = sizeof error;
  lpdeform_connection connection{};
  connection.struct_size = sizeof connection;
  connection.address = "localhost:1";
  connection.tls = 1;
  connection.root_certificates = "garbage";
  lpdeform_client* client = nullptr;
  EXPECT_EQ(lpdeform_connect(&connection, &client, &error), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error.reason, "TLS_CERTIFICATES");
  EXPECT_EQ(client, nullptr);
}

TEST(Border, NullIsAnErrorAndNoCrash) {
  lpdeform_error error{};
  error.struct_size = sizeof error;
  EXPECT_EQ(lpdeform_connect(nullptr, nullptr, &error), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_open(nullptr, nullptr, nullptr, nullptr, &error), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_poll(nullptr, nullptr, nullptr, nullptr), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_session_state(nullptr, &error), LPDEFORM_STATE_REFUSED);
  EXPECT_STREQ(error.reason, "ARGUMENT_MISSING");
  EXPECT_EQ(lpdeform_vertex_count(nullptr), 0);
  lpdeform_close(nullptr);
  lpdeform_disconnect(nullptr);
}

}  // namespace
}  // namespace lpdeform::engine
