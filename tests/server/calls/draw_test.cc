// Meshes as they are drawn, through the running service: split vertices are welded inside, and normals.

#include <cstring>
#include <functional>
#include <limits>
#include <map>

#include "core/mesh/carried_normals.h"
#include "service_fixture.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

class DrawTest : public ServiceTest {
 protected:
  static v1::CreateSessionRequest split_request(const TriangleMesh& split) {
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(split);
    request.mutable_weld()->mutable_position();
    return request;
  }

  static void set_normals(const Points& normals, v1::CreateSessionRequest& request) {
    request.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
    request.mutable_normals()->mutable_data()->set_inline_(packed(normals));
  }

  v1::CreateSessionResponse created(const v1::CreateSessionRequest& request) {
    v1::CreateSessionResponse response;
    const grpc::Status status = try_create(request, response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  /// A session of the split bar, its tip to be shifted by `x`.
  v1::CreateSessionResponse held_bar(double x = 2) {
    v1::CreateSessionRequest request = split_request(split_);
    set_normals(flat_normals(split_), request);
    *request.mutable_handles() = ends_message(split_.vertices, 0, x).handles();
    return created(request);
  }

  std::string reason_of(const v1::CreateSessionResponse& session, const v1::Update& change) {
    const grpc::Status status = update(session, change);
    return status.ok() ? "" : details_of(status).info.reason();
  }

  /// In float64.
  v1::SolveRequest solve_of(const v1::CreateSessionResponse& session) const {
    v1::SolveRequest request = solve_request(session);
    request.set_scalar(v1::SCALAR_FLOAT64);
    return request;
  }

  static Points points_of(const std::string& bytes) {
    Points points(static_cast<Eigen::Index>(bytes.size() / (3 * sizeof(double))), 3);
    std::memcpy(points.data(), bytes.data(), bytes.size());
    return points;
  }

  const TriangleMesh bar_ = box_surface(2, 2, 8);
  const TriangleMesh split_ = split_at_every_corner(bar_);
  const Weld weld_ = weld_by_position(split_.vertices).value();
};

TEST_F(DrawTest, ASplitMeshIsDeformedAsOneAndItsCopiesStayTogether) {
  const auto session = held_bar();
  EXPECT_EQ(session.session().mesh().vertices(), split_.vertices.rows());
  EXPECT_EQ(session.session().mesh().welded_vertices(), split_.vertices.rows() - bar_.vertices.rows());
  EXPECT_EQ(session.session().mesh().components(), 1u);
  EXPECT_EQ(session.session().handles(0).vertex_count(), vertices_at(split_.vertices, 0).size());
  v1::SolveRequest request = solve_of(session);
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const Points split = points_of(outcome.frame->positions);
  ASSERT_EQ(split.rows(), split_.vertices.rows());
  for (Eigen::Index v = 0; v < split.rows(); ++v) {
    const std::int32_t first = weld_.first_copy[weld_.to_welded[v]];
    EXPECT_EQ(std::memcmp(split.row(v).data(), split.row(first).data(), 24), 0);
    EXPECT_EQ(std::memcmp(outcome.frame->distortion.data() + 8 * v,
                          outcome.frame->distortion.data() + 8 * first, 8),
              0);
  }
  EXPECT_TRUE(outcome.frame->normals.empty()) << "they were not asked for";

  v1::CreateSessionRequest whole;
  *whole.mutable_mesh() = mesh_message(bar_);
  *whole.mutable_handles() = ends_message(bar_.vertices, 0, 2).handles();
  const SolveOutcome other = solve(solve_of(created(whole)));
  EXPECT_NEAR(outcome.summary.energy(), other.summary.energy(), 1e-3 * other.summary.energy());
}

TEST_F(DrawTest, AHandleOnOneCopyHoldsThemAll) {
  v1::CreateSessionRequest request = split_request(split_);
  v1::Update handles;
  const std::int32_t low = vertices_at(split_.vertices, 0)[0], high = vertices_at(split_.vertices, 8)[0];
  set_handle(handles, "low", {low}, 0);
  set_handle(handles, "high", {high}, 1);
  *request.mutable_handles() = handles.handles();
  const SolveOutcome outcome = solve(solve_of(created(request)));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const Points split = points_of(outcome.frame->positions);
  int copies = 0;
  for (Eigen::Index v = 0; v < split.rows(); ++v) {
    if (weld_.to_welded[v] != weld_.to_welded[high]) continue;
    ++copies;
    EXPECT_EQ(split.row(v), split_.vertices.row(v) + Eigen::RowVector3d(1, 0, 0));
  }
  EXPECT_GT(copies, 2);
}

TEST_F(DrawTest, NormalsOfHardEdgesAreFollowedInResultsAndFrames) {
  const auto session = held_bar();
  v1::SolveRequest request = solve_of(session);
  request.set_normals(true);
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const Points positions = points_of(outcome.frame->positions), normals = points_of(outcome.frame->normals);
  ASSERT_EQ(normals.rows(), split_.vertices.rows());
  const CarriedNormals carried(split_.faces, split_.vertices, weld_, flat_normals(split_));
  EXPECT_EQ(normals, carried.at(positions));

  v1::FrameOptions options;
  options.set_with_normals(true);
  DeformClient client(*stub_, session, options);
  v1::Update change;
  change.set_input_seq(1);
  move_handle(change, "tip", 1);
  ASSERT_TRUE(client.send(change));
  const auto frame = client.settle(1);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->normals.size(), frame->positions.size());
  EXPECT_EQ(frame->header.vertex_count(), split_.vertices.rows());
  for (std::size_t v = 0; v < static_cast<std::size_t>(split_.vertices.rows()); ++v) {
    float normal[3];
    std::memcpy(normal, frame->normals.data() + 12 * v, 12);
    EXPECT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1, 1e-5);
  }
}

TEST_F(DrawTest, NormalsNeedNoWeldAndNoNormalsAtRest) {
  const TriangleMesh ball = sphere(2);
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(ball);
  v1::Update handles;
  set_handle(handles, "all", vertices_at(ball.vertices, highest_z(ball.vertices)), 0);
  *request.mutable_handles() = handles.handles();
  v1::SolveRequest ask = solve_of(created(request));
  ask.set_normals(true);
  const SolveOutcome outcome = solve(ask);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_LT((points_of(outcome.frame->normals) - ball.vertices).cwiseAbs().maxCoeff(), 0.02);
}

TEST_F(DrawTest, WhatIsSaidOfCopiesMustBeTheSame) {
  const auto session = held_bar();
  v1::Update change;
  change.set_input_seq(1);
  const std::vector<std::int32_t> top = vertices_at(split_.vertices, 8);
  Points targets(static_cast<Eigen::Index>(top.size()), 3);
  for (std::size_t k = 0; k < top.size(); ++k)
    targets.row(static_cast<Eigen::Index>(k)) = split_.vertices.row(top[k]);
  v1::HandleUpdate& tip = *change.add_handles();
  tip.set_name("tip");
  tip.mutable_move()->mutable_targets()->set_scalar(v1::SCALAR_FLOAT64);
  std::string& bytes = *tip.mutable_move()->mutable_targets()->mutable_positions()->mutable_inline_();
  bytes = packed(targets);
  EXPECT_EQ(reason_of(session, change), "");
  targets(targets.rows() - 1, 2) += 0.5;
  bytes = packed(targets);
  change.set_input_seq(2);
  EXPECT_EQ(reason_of(session, change), "COPIES_DIFFER");

  v1::Update painted;
  painted.set_input_seq(3);
  Field p = Field::Constant(split_.vertices.rows(), 1.5);
  v1::FieldValues& values = *painted.mutable_settings()->mutable_p()->mutable_per_vertex();
  values.set_scalar(v1::SCALAR_FLOAT64);
  const auto put = [&] {
    values.mutable_values()->set_inline_(
        std::string(reinterpret_cast<const char*>(p.data()), sizeof(double) * p.size()));
  };
  put();
  EXPECT_EQ(reason_of(session, painted), "");
  p[p.size() - 1] = 2;
  put();
  painted.set_input_seq(4);
  EXPECT_EQ(reason_of(session, painted), "COPIES_DIFFER");

  v1::Update second;
  second.set_input_seq(5);
  std::int32_t copy = 0;  // of a vertex that the tip holds, but not one that it names
  const std::vector<std::int32_t> named(top.begin(), top.begin() + 1);
  set_handle(second, "tip", named, 0);
  while (copy == named[0] || weld_.to_welded[copy] != weld_.to_welded[named[0]]) ++copy;
  set_handle(second, "other", {copy}, 0);
  EXPECT_EQ(reason_of(session, second), "HANDLE_VERTEX_TWICE");

  v1::SolveRequest guess = solve_of(session);
  guess.mutable_initial_positions()->set_scalar(v1::SCALAR_FLOAT64);
  Points start = split_.vertices;
  start(0, 0) += 1;
  guess.mutable_initial_positions()->mutable_data()->set_inline_(packed(start));
  EXPECT_EQ(details_of(solve(guess).status).info.reason(), "COPIES_DIFFER");

  v1::SolveRequest request = solve_of(session);  // the session is as it was
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.summary.input_seq(), 3u);
}

TEST_F(DrawTest, ErrorsNameTheClientsVertices) {
  TriangleMesh two = split_at_every_corner(bar_mesh());
  const Eigen::Index n = two.vertices.rows(), m = two.faces.rows();
  two.vertices.conservativeResize(n + 3, 3);
  two.faces.conservativeResize(m + 1, 3);
  two.vertices.bottomRows(3) << 50, 0, 0, 51, 0, 0, 50, 1, 0;
  two.faces.row(m) << static_cast<int>(n), static_cast<int>(n) + 1, static_cast<int>(n) + 2;
  v1::CreateSessionRequest request = split_request(two);
  v1::Update handles;
  set_handle(handles, "base", vertices_at(bar_mesh().vertices, 0), 0);
  handles.mutable_handles(0)->mutable_set()->mutable_vertices()->set_inline_(
      packed(std::vector<std::int32_t>{0}));
  *request.mutable_handles() = handles.handles();
  const SolveOutcome outcome = solve(solve_of(created(request)));
  EXPECT_EQ(details_of(outcome.status).info.reason(), "COMPONENT_WITHOUT_HANDLE");
  EXPECT_NE(outcome.status.error_message().find("vertex " + std::to_string(n) + ")"), std::string::npos)
      << outcome.status.error_message();

  two.vertices(n + 1, 2) = std::numeric_limits<double>::quiet_NaN();
  v1::CreateSessionResponse response;
  const grpc::Status status = try_create(split_request(two), response);
  EXPECT_EQ(details_of(status).info.metadata().at("element"), "vertex " + std::to_string(n + 1));
}

TEST_F(DrawTest, WeldsAndNormalsThatDoNotFitAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto groups_of = [&](std::vector<std::int32_t> groups) {
    return [groups](v1::CreateSessionRequest& request) {
      request.mutable_weld()->mutable_groups()->set_inline_(packed(groups));
    };
  };
  std::vector<std::int32_t> all(static_cast<std::size_t>(bar_.vertices.rows()), 0), too_high = all;
  too_high.back() = static_cast<std::int32_t>(all.size());
  Points wrong = Points::Ones(bar_.vertices.rows(), 3);
  wrong(7, 1) = nan;
  const std::vector<std::pair<std::string, std::function<void(v1::CreateSessionRequest&)>>> cases{
      {"WELD_TOO_FAR", groups_of(all)},
      {"WELD_OUT_OF_RANGE", groups_of(too_high)},
      {"WELD_TOLERANCE",
       [](auto& request) { request.mutable_weld()->mutable_position()->set_tolerance(2e-3); }},
      {"WELD_TOLERANCE",
       [&](auto& request) { request.mutable_weld()->mutable_position()->set_tolerance(nan); }},
      {"WELD_SIZE", groups_of({0, 1})},
      {"WELD_SIZE", groups_of({})},
      {"MESH_EMPTY",
       [&](auto& request) {
         *request.mutable_mesh() = mesh_message({Points(0, 3), Faces(0, 3)});
         groups_of({})(request);
       }},
      {"BUFFER_SIZE", [](auto& request) { request.mutable_weld()->mutable_groups()->set_inline_("abc"); }},
      {"BUFFER_MISSING", [](auto& request) { request.mutable_weld()->mutable_groups(); }},
      {"NORMALS_SIZE", [](auto& request) { set_normals(Points::Ones(2, 3), request); }},
      {"NORMALS_NOT_FINITE", [&](auto& request) { set_normals(wrong, request); }},
  };
  for (const auto& [reason, change] : cases) {
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(bar_);
    change(request);
    v1::CreateSessionResponse response;
    const grpc::Status status = try_create(request, response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(details_of(status).info.reason(), reason);
  }
}

TEST_F(DrawTest, GroupsWeldWhatPositionsWouldNot) {
  TriangleMesh near = split_;
  std::vector<std::int32_t> groups = weld_.to_welded;
  for (Eigen::Index v = 0; v < near.vertices.rows(); ++v) near.vertices(v, 0) += 1e-7 * double(v % 7);
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(near);
  request.mutable_weld()->mutable_groups()->set_inline_(packed(groups));
  EXPECT_EQ(created(request).session().mesh().components(), 1u);
  request.mutable_weld()->mutable_position()->set_tolerance(1e-9);
  EXPECT_GT(created(request).session().mesh().components(), 1u);
  request.mutable_weld()->mutable_position()->set_tolerance(0);  // 1e-6
  EXPECT_EQ(created(request).session().mesh().components(), 1u);
}

TEST_F(DrawTest, TheReportSaysWhereAMeshIsSplitUnlessItIsWelded) {
  const TriangleMesh sphere = uv_sphere(12, 16);
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(sphere);
  const v1::MeshReport apart = created(request).session().mesh();
  std::map<std::string, v1::Defect> defects;
  for (const v1::Defect& defect : apart.defects()) defects[defect.kind()] = defect;
  EXPECT_GT(defects["split_border_vertices"].count(), 0u);
  EXPECT_EQ(defects["split_border_vertices"].first_size(), 10);
  request.mutable_weld()->mutable_position();
  const v1::MeshReport whole = created(request).session().mesh();
  for (const v1::Defect& defect : whole.defects())
    EXPECT_TRUE(defect.kind() != "split_border_vertices" || defect.count() == 0);
  EXPECT_EQ(whole.boundary_loops(), 0u);
}

TEST_F(DrawTest, AWeldedUvSphereIsDeformedInOnePiece) {
  const TriangleMesh sphere = uv_sphere(12, 16);
  v1::CreateSessionRequest request = split_request(sphere);
  v1::Update handles;
  set_handle(handles, "south", vertices_at(sphere.vertices, -1), 0);
  set_handle(handles, "north", vertices_at(sphere.vertices, 1), 1);
  *request.mutable_handles() = handles.handles();
  const SolveOutcome outcome = solve(solve_of(created(request)));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const Points bent = points_of(outcome.frame->positions);
  EXPECT_TRUE(bent.allFinite());
  for (int ring = 0; ring <= 12; ++ring) EXPECT_EQ(bent.row(17 * ring), bent.row(17 * ring + 16)) << ring;
}

}  // namespace
}  // namespace lpdeform
