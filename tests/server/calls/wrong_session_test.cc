// Sessions that the service refuses to make, because of their input or because a limit is reached.

#include <functional>
#include <limits>

#include "service_fixture.h"
#include "tests/support/glued_shape.h"

namespace lpdeform {
namespace {

struct WrongSession {
  const char* reason;
  const char* element;
  std::function<void(v1::CreateSessionRequest&)> spoil;
};

std::ostream& operator<<(std::ostream& out, const WrongSession& wrong) {
  return out << wrong.reason;
}

class WrongSessionTest : public ServiceTest, public testing::WithParamInterface<WrongSession> {};

TEST_P(WrongSessionTest, IsInvalidWithItsReasonAndElement) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(bar_mesh());
  GetParam().spoil(request);
  v1::CreateSessionResponse response;
  const grpc::Status status = try_create(request, response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  const ErrorDetails details = details_of(status);
  EXPECT_EQ(details.info.reason(), GetParam().reason);
  ASSERT_TRUE(details.bad_request.has_value());
  EXPECT_EQ(details.bad_request->field_violations(0).description(), status.error_message());
  if (*GetParam().element == '\0') return;
  EXPECT_EQ(details.info.metadata().at("element"), GetParam().element);
}

void overwrite(v1::CreateSessionRequest& request, std::size_t at, const void* bytes, std::size_t size) {
  std::memcpy(request.mutable_mesh()->mutable_data()->mutable_inline_()->data() + at, bytes, size);
}

INSTANTIATE_TEST_SUITE_P(
    Reasons, WrongSessionTest,
    testing::Values(
        WrongSession{"MESH_NOT_FINITE", "vertex 3",
                     [](auto& request) {
                       const double nan = std::numeric_limits<double>::quiet_NaN();
                       overwrite(request, 3 * 24 + 8, &nan, sizeof(nan));
                     }},
        WrongSession{"MESH_INDEX_OUT_OF_RANGE", "face 1",
                     [](auto& request) {
                       const std::uint32_t far = 0xffffffff;
                       overwrite(request, 370 * 24 + 12, &far, sizeof(far));
                     }},
        WrongSession{"BUFFER_SIZE", "mesh data",
                     [](auto& request) { request.mutable_mesh()->set_vertex_count(371); }},
        WrongSession{"MESH_TOO_LARGE", "mesh",
                     [](auto& request) { request.mutable_mesh()->set_vertex_count(0xffffffff); }},
        WrongSession{"BUFFER_MISSING", "mesh data",
                     [](auto& request) { request.mutable_mesh()->clear_data(); }},
        WrongSession{"MESH_EMPTY", "",
                     [](auto& request) {
                       request.mutable_mesh()->set_vertex_count(0);
                       request.mutable_mesh()->set_face_count(0);
                       request.mutable_mesh()->mutable_data()->set_inline_("");
                     }},
        WrongSession{"INLINE_TOO_LARGE", "mesh data",
                     [](auto& request) {
                       request.mutable_mesh()->mutable_data()->set_inline_(std::string((1u << 20) + 1, '\0'));
                     }},
        WrongSession{"REQUEST_ID", "request_id", [](auto& request) { request.set_request_id("short"); }},
        WrongSession{"ENUM_UNKNOWN", "weight kind",
                     [](auto& request) { request.set_weights(static_cast<v1::WeightKind>(77)); }},
        WrongSession{"P_OUT_OF_RANGE", "",
                     [](auto& request) { request.mutable_settings()->mutable_p()->set_uniform(0.5); }},
        WrongSession{
            "FIELD_SIZE", "p",
            [](auto& request) {
              request.mutable_settings()->mutable_p()->mutable_per_vertex()->mutable_values()->set_inline_(
                  std::string(12, '\0'));
            }},
        WrongSession{"FIELD_MISSING", "stiffness",
                     [](auto& request) { request.mutable_settings()->mutable_stiffness(); }},
        WrongSession{"HANDLE_CHANGE_MISSING", "handles",
                     [](auto& request) { request.add_handles()->set_name("a"); }},
        WrongSession{"MOTION_MISSING", "motion",
                     [](auto& request) { request.add_handles()->mutable_move(); }},
        WrongSession{"HANDLE_POINT_COUNT", "barycentric",
                     [](auto& request) {
                       v1::HandleUpdate& handle = *request.add_handles();
                       handle.set_name("a");
                       v1::SurfacePoints& points = *handle.mutable_set()->mutable_points();
                       points.mutable_faces()->set_inline_(std::string(8, '\0'));
                       points.mutable_barycentric()->set_inline_(std::string(12, '\0'));
                     }},
        WrongSession{"HANDLE_LOCK_DIRECTION", "handle \"a\"",
                     [](auto& request) {
                       v1::HandleUpdate& handle = *request.add_handles();
                       handle.set_name("a");
                       handle.mutable_set()->mutable_vertices()->set_inline_(std::string(4, '\0'));
                       handle.mutable_set()->mutable_axis_lock();
                     }},
        WrongSession{"REGION_EMPTY", "region",
                     [](auto& request) {
                       request.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_("");
                     }},
        WrongSession{"REGION_VERTEX_OUT_OF_RANGE", "vertex 4294967295",
                     [](auto& request) {
                       request.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_(
                           std::string(4, '\xff'));
                     }},
        WrongSession{"METHOD_NEEDS_EXACT_HANDLES", "handle \"a\"",
                     [](auto& request) {
                       request.mutable_settings()->mutable_p()->set_uniform(1);
                       request.mutable_settings()->mutable_solver()->set_method(v1::METHOD_CONIC);
                       v1::HandleUpdate& handle = *request.add_handles();
                       handle.set_name("a");
                       handle.mutable_set()->mutable_vertices()->set_inline_(std::string(4, '\0'));
                       handle.mutable_set()->mutable_soft();
                     }},
        WrongSession{"HANDLE_TOO_MANY_VERTICES", "handle vertices",
                     [](auto& request) {
                       v1::HandleUpdate& handle = *request.add_handles();
                       handle.set_name("a");
                       handle.mutable_set()->mutable_vertices()->set_inline_(std::string(371 * 4, '\0'));
                     }}),
    [](const auto& info) { return std::string(info.param.reason); });

class FullServerTest : public ServiceTest {
 protected:
  void SetUp() override {
    options_.max_bytes = 160'000'000;
    start();
  }
};

/// 48,000 vertices, which on a surface would fit.
TEST_F(FullServerTest, AMeshWhoseFactorisationDoesNotFitIsRefusedBeforeItIsMade) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(glued_at_random(3000));
  const std::string bytes = request.mesh().data().inline_();
  request.mutable_mesh()->mutable_data()->set_upload(upload(bytes));
  request.set_free_components(v1::FREE_COMPONENTS_STAY);
  v1::CreateSessionResponse response;
  EXPECT_EQ(details_of(try_create(request, response)).info.reason(), "MEMORY_FULL");
  create(grid(180, 180, 1));  // nothing is left of the other
}

class SmallServerTest : public ServiceTest {
 protected:
  void SetUp() override {
    options_.max_sessions = 1;
    options_.max_vertices = 400;
    options_.max_bytes = 2'000'000;
    start();
  }
};

TEST_F(SmallServerTest, AFullServerSaysWhenToTryAgain) {
  create(bar_mesh());
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(bar_mesh());
  v1::CreateSessionResponse response;
  const grpc::Status status = try_create(request, response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const ErrorDetails details = details_of(status);
  EXPECT_EQ(details.info.reason(), "SESSIONS_FULL");
  ASSERT_TRUE(details.retry.has_value());
  EXPECT_GE(details.retry->retry_delay().seconds(), 5);
  EXPECT_LE(details.retry->retry_delay().seconds(), 15);
  ASSERT_TRUE(details.quota.has_value());
  EXPECT_EQ(details.quota->violations(0).subject(), "sessions");
}

TEST_F(SmallServerTest, TooLargeAMeshNamesTheLimit) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(box_surface(5, 5, 20));
  v1::CreateSessionResponse response;
  const ErrorDetails details = details_of(try_create(request, response));
  EXPECT_EQ(details.info.reason(), "MESH_TOO_LARGE");
  EXPECT_EQ(details.info.metadata().at("limit"), "vertices <= 400, faces <= 1200");
}

TEST_F(SmallServerTest, MemoryIsGivenOnceOnly) {
  upload(std::string(1'500'000, 'x'));
  v1::CreateUploadRequest announce;
  announce.set_size_bytes(1'500'000);
  v1::CreateUploadResponse created;
  grpc::ClientContext second;
  const grpc::Status status = stub_->CreateUpload(&second, announce, &created);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(details_of(status).info.reason(), "MEMORY_FULL");
}

}  // namespace
}  // namespace lpdeform
