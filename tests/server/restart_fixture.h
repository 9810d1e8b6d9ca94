#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "faulty_store.h"
#include "server/sqlite_store.h"
#include "service_fixture.h"

namespace lpdeform {

/// One of everything that a session can have.
inline v1::Update everything(const TriangleMesh& mesh) {
  v1::Update update = ends_message(mesh.vertices, 7, 2);
  const auto handle = [&](const std::string& name) -> v1::Handle& {
    v1::HandleUpdate& change = *update.add_handles();
    change.set_name(name);
    return *change.mutable_set();
  };
  v1::Handle& soft = handle("soft");
  soft.mutable_vertices()->set_inline_(packed(vertices_at(mesh.vertices, 5)));
  soft.mutable_soft()->set_weight(0.25);
  soft.set_footprint_radius(1.5);
  v1::Handle& turned = handle("turned");
  turned.mutable_vertices()->set_inline_(packed(vertices_at(mesh.vertices, 8)));
  turned.mutable_orientation()->set_weight(30);
  turned.mutable_motion()->mutable_rigid()->mutable_axis()->set_z(1);
  turned.mutable_motion()->mutable_rigid()->set_angle_radians(0.3);
  turned.mutable_motion()->mutable_rigid()->mutable_center()->set_x(0.5);
  v1::Handle& rail = handle("rail");
  rail.mutable_vertices()->set_inline_(packed(std::vector<std::int32_t>{vertices_at(mesh.vertices, 11)[0]}));
  rail.mutable_axis_lock()->mutable_axis()->set_x(1);
  v1::Handle& plane = handle("plane");
  plane.mutable_vertices()->set_inline_(packed(std::vector<std::int32_t>{vertices_at(mesh.vertices, 13)[0]}));
  plane.mutable_plane_lock()->mutable_normal()->set_y(2);
  v1::Handle& inside = handle("inside");
  const std::int32_t last_face = static_cast<std::int32_t>(mesh.faces.rows()) / 2;
  inside.mutable_points()->mutable_faces()->set_inline_(packed(std::vector<std::int32_t>{last_face}));
  inside.mutable_points()->set_scalar(v1::SCALAR_FLOAT64);
  const std::vector<double> weights{0.2, 0.3, 0.5};
  inside.mutable_points()->mutable_barycentric()->set_inline_(weights.data(), 24);
  inside.mutable_soft()->set_weight(2);
  v1::Handle& free = handle("free");
  const std::int32_t vertex = vertices_at(mesh.vertices, 15)[0];
  free.mutable_vertices()->set_inline_(packed(std::vector<std::int32_t>{vertex}));
  const Points target = mesh.vertices.row(vertex).array() + 0.25;
  free.mutable_motion()->mutable_targets()->set_scalar(v1::SCALAR_FLOAT64);
  free.mutable_motion()->mutable_targets()->mutable_positions()->set_inline_(packed(target));
  v1::SettingsUpdate& settings = *update.mutable_settings();
  const Field p = Field::LinSpaced(mesh.vertices.rows(), 1.25, 3);
  settings.mutable_p()->mutable_per_vertex()->set_scalar(v1::SCALAR_FLOAT64);
  settings.mutable_p()->mutable_per_vertex()->mutable_values()->set_inline_(
      p.data(), static_cast<std::size_t>(p.size()) * sizeof(double));
  settings.mutable_stiffness()->mutable_automatic()->set_strength(0.5);
  settings.mutable_length_unit()->set_length(0.75);
  settings.mutable_solver()->set_method(v1::METHOD_QUASI_NEWTON);
  settings.mutable_solver()->set_tolerance(1e-7);
  settings.mutable_solver()->set_max_iterations(500);
  settings.mutable_solver()->set_time_limit_seconds(60);
  settings.mutable_solver()->set_initial(v1::INITIAL_GUESS_LAPLACIAN);
  return update;
}

/// A server with a store in a folder, and those that come after it.
class RestartTest : public ServiceTest {
 protected:
  RestartTest() {
    char name[] = "/tmp/lpdeform-restart-XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~RestartTest() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }
  void SetUp() override { restart(); }

  /// Another server with the same store.
  void restart() {
    server_.reset();
    options_.store.reset();
    faults_.reset();
    auto store = open_sqlite_store({folder_});
    ASSERT_TRUE(store.ok()) << store.status();
    options_.store = faults_ = std::make_shared<FaultyStore>(*std::move(store));
    start();
  }

  v1::UpdateResult take(const v1::CreateSessionResponse& session, const v1::Update& update) {
    v1::UpdateHandlesRequest request;
    request.set_session(session.session().name());
    request.set_writer_token(session.writer_token());
    *request.mutable_update() = update;
    v1::UpdateHandlesResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->UpdateHandles(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.result();
  }

  grpc::Status get(const std::string& name, v1::Session& session) {
    v1::GetSessionRequest request;
    request.set_session(name);
    v1::GetSessionResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->GetSession(&context, request, &response);
    session = response.session();
    return status;
  }

  /// All of a session that clients can see but what differs from one process to the next.
  std::string seen(const v1::CreateSessionResponse& session) {
    v1::Session found;
    EXPECT_TRUE(get(session.session().name(), found).ok());
    found.clear_epoch();
    found.clear_expires_unix_ms();
    found.clear_memory_bytes();
    return found.DebugString();
  }

  /// The solved positions.
  std::string solved(const v1::CreateSessionResponse& session) {
    v1::SolveRequest request = solve_request(session);
    request.set_scalar(v1::SCALAR_FLOAT64);
    const SolveOutcome outcome = solve(request);
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return outcome.frame ? outcome.frame->positions : "";
  }

  std::string folder_;
  std::shared_ptr<FaultyStore> faults_;
};

}  // namespace lpdeform
