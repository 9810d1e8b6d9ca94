// Values that the running service finds in a mesh's geometry: automatic fields and resizing.

#include <array>
#include <condition_variable>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <vector>

#include "core/analysis/automatic_material.h"
#include "core/mesh/weld.h"
#include "core/resize/resize.h"
#include "service_fixture.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

TriangleMesh neck_mesh() {
  return necked_bar(4, 20, 2, 4);
}

/// The plane y = 0 goes through vertices.
TriangleMesh neck_mesh_around_origin() {
  TriangleMesh mesh = neck_mesh();
  mesh.vertices.col(1).array() -= 2;
  return mesh;
}

void set_automatic(v1::SettingsUpdate& settings, double strength) {
  settings.mutable_p()->mutable_automatic()->set_strength(strength);
  settings.mutable_stiffness()->mutable_automatic()->set_strength(strength);
}

void set_scale(v1::Update& update, double x, double y, double z) {
  v1::Vector3& scale = *update.mutable_resize()->mutable_scale();
  scale.set_x(x);
  scale.set_y(y);
  scale.set_z(z);
}

class GeometryTest : public ServiceTest {
 protected:
  v1::Session describe(const v1::CreateSessionResponse& session) {
    v1::GetSessionRequest request;
    v1::GetSessionResponse response;
    grpc::ClientContext context;
    request.set_session(session.session().name());
    EXPECT_TRUE(stub_->GetSession(&context, request, &response).ok());
    return response.session();
  }

  v1::CreateSessionResponse create_welded(const TriangleMesh& split, const v1::SettingsUpdate& settings) {
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(split);
    request.mutable_weld()->mutable_position();
    *request.mutable_settings() = settings;
    v1::CreateSessionResponse response;
    EXPECT_TRUE(try_create(request, response).ok());
    EXPECT_GT(response.session().mesh().welded_vertices(), 0u);
    return response;
  }

  SolveOutcome solve_in_doubles(const v1::CreateSessionResponse& session) {
    v1::SolveRequest request = solve_request(session);
    request.set_scalar(v1::SCALAR_FLOAT64);
    return solve(request);
  }
};

/// The energy of the same deformation without a network.
double energy_of(const TriangleMesh& mesh, const Update& update, const Material& material) {
  HandleSet handles;
  for (const HandleChange& change : update.handles)
    (void)handles.set(change.name, std::get<Handle>(change.change));
  const auto deformer = deformer_of(shape_of(mesh));
  EXPECT_TRUE(deformer->set_handles(handles).ok());
  EXPECT_TRUE(deformer->set_material(material).ok());
  return deformer->solve({}).value().energy;
}

TEST_F(GeometryTest, AutomaticFieldsAreThoseOfTheCore) {
  const TriangleMesh mesh = neck_mesh();
  const auto session = create(mesh);
  v1::Update message = ends_message(mesh.vertices, 1, 3);
  set_automatic(*message.mutable_settings(), 0.7);
  ASSERT_TRUE(update(session, message).ok());
  const SolveOutcome outcome = solve_in_doubles(session);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const Material material = automatic_material(*shape_of(mesh), 0.7).value();
  EXPECT_DOUBLE_EQ(outcome.summary.energy(), energy_of(mesh, hold_ends(mesh.vertices, 1, 3), material));
  EXPECT_TRUE(describe(session).settings().p().has_per_vertex());
}

TEST_F(GeometryTest, ASessionMayBeginWithAutomaticFields) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(neck_mesh());
  set_automatic(*request.mutable_settings(), 1);
  v1::CreateSessionResponse created;
  ASSERT_TRUE(try_create(request, created).ok());
  EXPECT_TRUE(created.session().settings().p().has_per_vertex());
  EXPECT_TRUE(created.session().settings().stiffness().has_per_vertex());
}

/// Updates that are under way at once, each with automatic fields, or a resizing.
class UpdatesUnderWay {
 public:
  UpdatesUnderWay(v1::DeformService::Stub& stub, const v1::CreateSessionResponse& session, int count) {
    for (int k = 0; k < count; ++k) {
      One& one = ones_.emplace_back();
      one.context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
      one.request.set_session(session.session().name());
      one.request.set_writer_token(session.writer_token());
      one.request.mutable_update()->set_input_seq(static_cast<std::uint64_t>(1 + k));
      if (k == 1) {
        set_scale(*one.request.mutable_update(), 2, 1, 1);
      } else {
        set_automatic(*one.request.mutable_update()->mutable_settings(), 1);
      }
      stub.async()->UpdateHandles(&one.context, &one.request, &one.response, [this](grpc::Status status) {
        const std::scoped_lock lock(mutex_);
        statuses_.push_back(std::move(status));
        changed_.notify_all();
      });
    }
  }
  ~UpdatesUnderWay() { wait(); }

  std::vector<grpc::Status> ended() const {
    const std::scoped_lock lock(mutex_);
    return statuses_;
  }
  std::vector<grpc::Status> wait() const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return statuses_.size() == ones_.size(); });
    return statuses_;
  }

 private:
  struct One {
    grpc::ClientContext context;
    v1::UpdateHandlesRequest request;
    v1::UpdateHandlesResponse response;
  };
  std::deque<One> ones_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<grpc::Status> statuses_;
};

TEST_F(GeometryTest, OthersAreAnsweredWhileTheGeometryOfALargeMeshIsLookedAt) {
  const auto small = create(bar_mesh());
  std::uint64_t seq = 0;
  bool are_others_first = false;
  // The updates may be over before this thread gets a turn.
  for (int tries = 0; tries < 10 && !are_others_first; ++tries) {
    const auto large = create(necked_bar(60, 80, 20, 20));
    const UpdatesUnderWay updates(*stub_, large, 8);  // more than the pool has threads
    for (int k = 0; k < 20; ++k) ASSERT_TRUE(update(small, ends_message(bar_mesh().vertices, ++seq, 1)).ok());
    are_others_first = updates.ended().empty();
    for (const grpc::Status& status : updates.wait()) EXPECT_TRUE(status.ok()) << status.error_message();
    const v1::Session after = describe(large);
    EXPECT_TRUE(after.settings().p().has_per_vertex());
    EXPECT_EQ(after.handles_size(), 1);
  }
  EXPECT_TRUE(are_others_first);
}

TEST_F(GeometryTest, AStreamAndASolveWaitForTheGeometryInTheirTurn) {
  const auto session = create(block_with_holes(14, 6, 4));
  DeformClient client(*stub_, session);
  v1::Update message;
  message.set_input_seq(1);
  set_scale(message, 2, 1, 1);
  ASSERT_TRUE(client.send(message));
  message.set_input_seq(2);
  set_automatic(*message.mutable_settings(), 1);
  ASSERT_TRUE(client.send(message));
  ASSERT_TRUE(client.settle(2).has_value());
  ASSERT_EQ(client.history.results.size(), 2u);
  EXPECT_EQ(client.history.results[0].input_seq(), 1u);

  const auto another = create(neck_mesh());
  v1::SolveRequest request = solve_request(another);
  *request.mutable_update() = ends_message(neck_mesh().vertices, 1, 3);
  set_automatic(*request.mutable_update()->mutable_settings(), 1);
  EXPECT_TRUE(solve(request).status.ok());
  EXPECT_TRUE(describe(another).settings().p().has_per_vertex());
}

TEST_F(GeometryTest, AnUpdateOfSomebodyElseNeverLooksAtTheGeometry) {
  const auto session = create(neck_mesh());
  v1::UpdateHandlesRequest request;
  v1::UpdateHandlesResponse response;
  grpc::ClientContext context;
  request.set_session(session.session().name());
  request.set_writer_token("another");
  set_automatic(*request.mutable_update()->mutable_settings(), 1);
  EXPECT_EQ(details_of(stub_->UpdateHandles(&context, request, &response)).info.reason(), "NOT_THE_WRITER");
}

class GeometryWithLittleMemoryTest : public GeometryTest {
 protected:
  void SetUp() override {
    options_.max_bytes = 2'000'000;
    start();
  }
};

TEST_F(GeometryWithLittleMemoryTest, WhatWaitsForTheGeometryIsCountedUntilItsTurn) {
  const auto session = create(neck_mesh());
  v1::Update message;
  message.set_input_seq(1);
  set_automatic(*message.mutable_settings(), 1);
  for (const char* const name : {"a", "b"}) {
    v1::HandleUpdate& handle = *message.add_handles();
    handle.set_name(name);
    handle.mutable_set()->mutable_vertices()->set_inline_(std::string(1 << 20, '\0'));
  }
  const ErrorDetails details = details_of(update(session, message));
  EXPECT_EQ(details.info.reason(), "MEMORY_FULL");
  EXPECT_TRUE(details.retry.has_value());
  message.clear_handles();
  for (std::uint64_t seq = 2; seq < 5; ++seq) {
    message.set_input_seq(seq);
    EXPECT_TRUE(update(session, message).ok());
  }
}

TEST_F(GeometryTest, AStrengthOutOfRangeIsRefusedWhole) {
  const auto session = create(neck_mesh());
  for (const double strength : {-0.5, 1.5, std::numeric_limits<double>::quiet_NaN()}) {
    v1::Update message = ends_message(neck_mesh().vertices, 1, 3);
    set_automatic(*message.mutable_settings(), strength);
    const grpc::Status status = update(session, message);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(details_of(status).info.reason(), "STRENGTH_OUT_OF_RANGE");
  }
  EXPECT_EQ(describe(session).handles_size(), 0);
}

TEST_F(GeometryTest, AMethodForOnePTakesAnAutomaticFieldOfStrengthZeroOnly) {
  const auto session = create(neck_mesh());
  v1::Update message = ends_message(neck_mesh().vertices, 1, 3);
  set_automatic(*message.mutable_settings(), 1);
  message.mutable_settings()->mutable_solver()->set_method(v1::METHOD_LOCAL_GLOBAL);
  EXPECT_EQ(details_of(update(session, message)).info.reason(), "METHOD_NEEDS_P");
  set_automatic(*message.mutable_settings(), 0);
  EXPECT_TRUE(update(session, message).ok());
}

TEST_F(GeometryTest, ResizingMeetsTheScaledExtentAndIsLive) {
  const TriangleMesh mesh = block_with_holes(14, 6, 4);
  const auto session = create(mesh);
  std::uint64_t seq = 0;
  for (const double factor : {1.5, 2.0, 1.0}) {
    v1::Update message;
    message.set_input_seq(++seq);
    set_scale(message, factor, 1, 1);
    ASSERT_TRUE(update(session, message).ok());
    const SolveOutcome outcome = solve_in_doubles(session);
    ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    double low = 0, high = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(mesh.vertices.rows()); ++i) {
      low = std::min(low, outcome.frame->position<double>(i, 0));
      high = std::max(high, outcome.frame->position<double>(i, 0));
    }
    EXPECT_NEAR(high - low, 14 * factor, 1e-9);
    EXPECT_NEAR(low, 7 - 7 * factor, 1e-9);  // about the middle
  }
  ASSERT_EQ(describe(session).handles_size(), 1);
  EXPECT_EQ(describe(session).handles(0).name(), "resize");
  EXPECT_EQ(describe(session).settings().p().uniform(), 1);
  EXPECT_TRUE(describe(session).settings().stiffness().has_per_vertex());
}

TEST_F(GeometryTest, ResizingLeavesThePAndStiffnessOfTheSameUpdate) {
  const auto session = create(neck_mesh());
  v1::Update message;
  message.set_input_seq(1);
  set_scale(message, 1, 1, 2);
  message.mutable_settings()->mutable_p()->set_uniform(1.25);
  message.mutable_settings()->mutable_stiffness()->set_uniform(3);
  ASSERT_TRUE(update(session, message).ok());
  EXPECT_EQ(describe(session).settings().p().uniform(), 1.25);
  EXPECT_EQ(describe(session).settings().stiffness().uniform(), 3);
}

TEST_F(GeometryTest, AutomaticFieldsOfAWeldedMeshAreThoseOfTheWhole) {
  const TriangleMesh split = split_along_seam(neck_mesh_around_origin());
  v1::Update message = ends_message(split.vertices, 1, 3);
  set_automatic(*message.mutable_settings(), 0.7);
  const auto session = create_welded(split, {});
  ASSERT_TRUE(update(session, message).ok());
  const SolveOutcome outcome = solve_in_doubles(session);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const TriangleMesh whole = welded(split, weld_by_position(split.vertices).value());
  const Material material = automatic_material(*shape_of(whole), 0.7).value();
  EXPECT_DOUBLE_EQ(outcome.summary.energy(), energy_of(whole, hold_ends(whole.vertices, 1, 3), material));
  EXPECT_TRUE(describe(session).settings().p().has_per_vertex());

  const auto begun = create_welded(split, message.settings());
  message.clear_settings();
  ASSERT_TRUE(update(begun, message).ok());
  EXPECT_EQ(solve_in_doubles(begun).summary.energy(), outcome.summary.energy());
}

TEST_F(GeometryTest, ResizingAWeldedMeshHoldsAllCopiesOfItsEnds) {
  const TriangleMesh split = split_at_every_corner(box_surface(4, 2, 2));
  const auto session = create_welded(split, {});
  v1::Update message;
  message.set_input_seq(1);
  set_scale(message, 2, 1, 1);
  ASSERT_TRUE(update(session, message).ok());
  const SolveOutcome outcome = solve_in_doubles(session);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  std::map<std::array<double, 3>, std::array<double, 3>> place_of;
  for (std::size_t v = 0; v < static_cast<std::size_t>(split.vertices.rows()); ++v) {
    const Eigen::RowVector3d rest = split.vertices.row(static_cast<Eigen::Index>(v));
    const std::array<double, 3> at{outcome.frame->position<double>(v, 0),
                                   outcome.frame->position<double>(v, 1),
                                   outcome.frame->position<double>(v, 2)};
    EXPECT_EQ(place_of.try_emplace({rest[0], rest[1], rest[2]}, at).first->second, at) << v;
    if (rest[0] != 0 && rest[0] != 4) continue;
    EXPECT_NEAR(at[0], 2 * rest[0] - 2, 1e-12);
    EXPECT_NEAR(at[1], rest[1], 1e-12);
    EXPECT_NEAR(at[2], rest[2], 1e-12);
  }
  EXPECT_EQ(place_of.size(), static_cast<std::size_t>(box_surface(4, 2, 2).vertices.rows()));
  EXPECT_TRUE(describe(session).settings().stiffness().has_per_vertex());
}

TEST_F(GeometryTest, AResizingOutOfRangeIsRefusedWhole) {
  const auto session = create(neck_mesh());
  const auto reason_of = [&](v1::Update message) {
    message.set_input_seq(1);
    const grpc::Status status = update(session, message);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return details_of(status).info.reason();
  };
  v1::Update message;
  message.mutable_resize();
  EXPECT_EQ(reason_of(message), "RESIZE_SCALE_OUT_OF_RANGE");  // left out: 0, 0, 0
  set_scale(message, 1, 2, 1000);
  EXPECT_EQ(reason_of(message), "RESIZE_SCALE_OUT_OF_RANGE");
  set_scale(message, 1, 2, 1);
  message.mutable_resize()->mutable_x_axis()->set_x(1);
  EXPECT_EQ(reason_of(message), "RESIZE_AXES");  // y_axis left out
  message.mutable_resize()->mutable_y_axis()->set_x(2);
  EXPECT_EQ(reason_of(message), "RESIZE_AXES");  // parallel
  message.mutable_resize()->mutable_y_axis()->set_y(2);
  message.mutable_resize()->mutable_origin()->set_z(std::numeric_limits<double>::infinity());
  EXPECT_EQ(reason_of(message), "RESIZE_ORIGIN_NOT_FINITE");
  message.mutable_resize()->clear_origin();
  message.add_handles()->set_name("resize");
  message.mutable_handles(0)->mutable_remove();
  EXPECT_EQ(reason_of(message), "HANDLE_CHANGED_TWICE");
  EXPECT_EQ(describe(session).handles_size(), 0);
  EXPECT_EQ(describe(session).settings().p().uniform(), 2);
}

}  // namespace
}  // namespace lpdeform
