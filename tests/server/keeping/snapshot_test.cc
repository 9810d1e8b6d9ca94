// Sessions as files: whole, damaged, foreign and hostile ones.

#include "server/keeping/snapshot.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "core/base/fault.h"
#include "restart_fixture.h"
#include "server/keeping/stored.pb.h"
#include "server/session/session.h"
#include "server/wire/parsed_size.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

constexpr std::size_t kMostInline = 1u << 20;

class SnapshotTest : public RestartTest {
 protected:
  grpc::Status try_snapshot(const std::string& session, std::string& file) {
    v1::SnapshotSessionRequest request;
    request.set_session(session);
    grpc::ClientContext context;
    const auto reader = stub_->SnapshotSession(&context, request);
    v1::SnapshotSessionResponse part;
    file.clear();
    while (reader->Read(&part)) {
      EXPECT_EQ(part.offset(), file.size());
      EXPECT_LE(part.data().size(), kMostInline);
      file += part.data();
      EXPECT_LE(file.size(), part.size_bytes());
    }
    EXPECT_EQ(file.size(), part.size_bytes());
    return reader->Finish();
  }
  std::string snapshot(const v1::CreateSessionResponse& session) {
    std::string file;
    const grpc::Status status = try_snapshot(session.session().name(), file);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return file;
  }

  grpc::Status try_restore(const std::string& file, v1::CreateSessionResponse& session,
                           const std::string& request_id = "") {
    v1::RestoreSessionRequest request;
    request.set_request_id(request_id);
    if (file.size() <= kMostInline)
      request.mutable_snapshot()->set_inline_(file);
    else
      request.mutable_snapshot()->set_upload(upload(file));
    v1::RestoreSessionResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->RestoreSession(&context, request, &response);
    *session.mutable_session() = response.session();
    session.set_writer_token(response.writer_token());
    return status;
  }
  v1::CreateSessionResponse restored(const std::string& file) {
    v1::CreateSessionResponse session;
    const grpc::Status status = try_restore(file, session);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return session;
  }
  std::string refusal(const std::string& file) {
    v1::CreateSessionResponse session;
    const grpc::Status status = try_restore(file, session);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_FALSE(status.error_message().empty());
    return details_of(status).info.reason();
  }
  int sessions() {
    v1::ListSessionsResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(stub_->ListSessions(&context, {}, &response).ok());
    return response.sessions_size();
  }

  /// What is seen of it, but what is each session's own.
  std::string shown(const v1::CreateSessionResponse& session) {
    v1::Session found;
    EXPECT_TRUE(get(session.session().name(), found).ok());
    found.clear_name();
    found.clear_epoch();
    found.clear_created_unix_ms();
    found.clear_expires_unix_ms();
    found.clear_memory_bytes();
    return found.DebugString();
  }
};

/// A file of this content, its header right.
std::string sealed(const stored::Snapshot& snapshot) {
  const std::string content = snapshot.SerializeAsString();
  return snapshot_header(content) + content;
}

stored::Snapshot opened(const std::string& file) {
  stored::Snapshot snapshot;
  EXPECT_TRUE(snapshot.ParseFromString(file.substr(kSnapshotHeaderBytes)));
  return snapshot;
}

/// Changes one part of a snapshot.
template <typename Message>
void change_part(stored::Snapshot& snapshot, const std::string& name,
                 const std::function<void(Message&)>& change) {
  Message message;
  ASSERT_TRUE(message.ParseFromString(snapshot.parts().at(name)));
  change(message);
  (*snapshot.mutable_parts())[name] = message.SerializeAsString();
}

TEST_F(SnapshotTest, ARestoredSessionIsTheSameToTheLastBitAndGoesItsOwnWay) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  take(session, everything(mesh));
  const std::string solved_before = solved(session), seen_before = shown(session);
  const auto copy = restored(snapshot(session));
  EXPECT_NE(copy.session().name(), session.session().name());
  EXPECT_NE(copy.writer_token(), session.writer_token());
  EXPECT_EQ(copy.session().epoch(), 1u);
  EXPECT_EQ(shown(copy), seen_before);
  EXPECT_TRUE(solved(copy) == solved_before);
  EXPECT_EQ(take(copy, tip_message(9, 3)).stale_parts(), 0u);
  EXPECT_EQ(take(copy, tip_message(6, 4)).stale_parts(), 1u);  // older than what the snapshot had
  EXPECT_EQ(shown(session), seen_before);
  restart();  // it is kept like any other
  EXPECT_TRUE(solved(session) == solved_before);
  EXPECT_EQ(take(copy, tip_message(10, 3)).stale_parts(), 0u);
}

TEST_F(SnapshotTest, ItBeginsWithTheSurfaceThatWasThere) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  EXPECT_FALSE(opened(snapshot(session)).has_surface());  // nothing has been solved for
  v1::FrameOptions options;
  options.set_scalar(v1::SCALAR_FLOAT64);
  std::string was;
  {
    DeformClient stream(*stub_, session, options);
    ASSERT_TRUE(stream.send(ends_message(mesh.vertices, 1, 2)));
    const auto frame = stream.settle(1);
    ASSERT_TRUE(frame.has_value());
    was = frame->positions;
  }
  const auto copy = restored(snapshot(session));
  EXPECT_TRUE(opened(snapshot(copy)).surface().data().inline_() == was);
  DeformClient stream(*stub_, copy, options);
  EXPECT_TRUE(stream.settle(1).has_value());
}

TEST_F(SnapshotTest, ASurfaceThatNothingHoldsAnyMoreHasItsEnergies) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  v1::FrameOptions options;
  options.set_scalar(v1::SCALAR_FLOAT64);
  v1::Update update = ends_message(mesh.vertices, 1, 2);
  update.mutable_settings()->mutable_p()->set_uniform(1.5);
  ReceivedFrame was;
  {
    DeformClient stream(*stub_, session, options);
    ASSERT_TRUE(stream.send(update));
    const auto frame = stream.settle(1);
    ASSERT_TRUE(frame.has_value());
    was = *frame;
    update.clear_settings();
    for (auto& handle : *update.mutable_handles()) {
      const std::string name = handle.name();
      handle.Clear();
      handle.set_name(name);
      handle.mutable_remove();
    }
    update.set_input_seq(2);
    ASSERT_TRUE(stream.send(update));
    ASSERT_TRUE(stream.settle(2).has_value());
  }
  const auto copy = restored(snapshot(session));
  DeformClient stream(*stub_, copy, options);
  const auto frame = stream.next_frame();
  ASSERT_TRUE(frame.has_value());
  EXPECT_GT(was.header.energy(), 1);
  EXPECT_NEAR(frame->header.energy(), was.header.energy(), 1e-9 * was.header.energy());
  EXPECT_TRUE(frame->positions == was.positions);
  ASSERT_EQ(frame->distortion.size(), was.distortion.size());
  std::vector<double> now(was.distortion.size() / sizeof(double)), then(now.size());
  std::memcpy(now.data(), frame->distortion.data(), was.distortion.size());
  std::memcpy(then.data(), was.distortion.data(), was.distortion.size());
  for (std::size_t v = 0; v < now.size(); ++v) EXPECT_NEAR(now[v], then[v], 1e-9) << v;
}

TEST_F(SnapshotTest, AWeldedSessionWithNormalsIsTheSame) {
  const TriangleMesh mesh = two_bars_mesh();
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(mesh);
  std::vector<std::int32_t> groups;
  for (std::int32_t v = 0; v < mesh.vertices.rows(); ++v) groups.push_back(v);
  request.mutable_weld()->mutable_groups()->set_inline_(packed(groups));
  request.set_weights(v1::WEIGHT_KIND_UNIFORM);
  request.set_free_components(v1::FREE_COMPONENTS_FOLLOW);
  Points normals = Points::Zero(mesh.vertices.rows(), 3);
  normals.col(1).setOnes();
  request.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
  request.mutable_normals()->mutable_data()->set_inline_(packed(normals));
  *request.mutable_handles() = ends_message(mesh.vertices, 0, 1).handles();
  request.mutable_settings()->mutable_solver()->set_initial(
      v1::INITIAL_GUESS_LAPLACIAN);  // whatever came before
  v1::CreateSessionResponse session;
  ASSERT_TRUE(try_create(request, session).ok());
  const std::string solved_before = solved(session), seen_before = shown(session);
  const auto copy = restored(snapshot(session));
  EXPECT_EQ(shown(copy), seen_before);
  EXPECT_TRUE(solved(copy) == solved_before);
  EXPECT_TRUE(snapshot(copy) == snapshot(restored(snapshot(copy))));
}

TEST_F(SnapshotTest, CopiesOfVerticesAndARegionAreTheSame) {
  const TriangleMesh whole = bar_mesh(), mesh = split_at_every_corner(whole);
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(mesh);
  std::vector<std::int32_t> groups;
  for (Eigen::Index corner = 0; corner < 3 * whole.faces.rows(); ++corner)
    groups.push_back(whole.faces(corner / 3, corner % 3));
  request.mutable_weld()->mutable_groups()->set_inline_(packed(groups));
  const Points normals = flat_normals(mesh);
  request.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
  request.mutable_normals()->mutable_data()->set_inline_(packed(normals));
  v1::CreateSessionResponse session;
  ASSERT_TRUE(try_create(request, session).ok());
  take(session, ends_message(mesh.vertices, 1, 2));
  const std::string bent = solved(session);
  v1::Update update = tip_message(2, 3);
  std::vector<std::int32_t> upper;
  for (std::int32_t v = 0; v < mesh.vertices.rows(); ++v) {
    if (mesh.vertices(v, 2) >= 4) upper.push_back(v);
  }
  update.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_(packed(upper));
  take(session, update);  // what is outside stays bent
  const std::string solved_before = solved(session), seen_before = shown(session);
  EXPECT_TRUE(solved_before != bent);
  const std::string file = snapshot(session);
  const auto copy = restored(file);
  EXPECT_EQ(shown(copy), seen_before);
  EXPECT_TRUE(opened(snapshot(copy)).surface().data().inline_() == solved_before);
  const auto other = restored(file);
  for (const auto& one : {copy, other}) take(one, tip_message(3, 4));
  const std::string further = solved(copy);
  EXPECT_TRUE(further == solved(other));
  const std::size_t outside = 24 * static_cast<std::size_t>(vertices_at(mesh.vertices, 2)[0]);
  EXPECT_TRUE(further.substr(outside, 24) == bent.substr(outside, 24));
}

TEST_F(SnapshotTest, StepsCanBeTakenBackInTheCopyToo) {
  const auto session = create(bar_mesh());
  take(session, ends_message(bar_mesh().vertices, 1, 0));
  take(session, tip_message(2, 5));
  const auto copy = restored(snapshot(session));
  v1::UndoUpdateRequest request;
  request.set_session(copy.session().name());
  request.set_writer_token(copy.writer_token());
  request.set_input_seq(3);
  v1::UndoUpdateResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->UndoUpdate(&context, request, &response).ok());
  EXPECT_EQ(response.changes(0).move().rigid().translation().x(), 0);
}

TEST_F(SnapshotTest, ALargeOneComesInPartsAndTheSameRequestGivesTheSameSession) {
  const TriangleMesh mesh = box_surface(100, 100, 100);
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(mesh);
  request.mutable_mesh()->mutable_data()->set_upload(upload(request.mesh().data().inline_()));
  v1::CreateSessionResponse session, first, second;
  ASSERT_TRUE(try_create(request, session).ok());
  const std::string file = snapshot(session);
  EXPECT_GT(file.size(), 2 * kMostInline);
  const std::string name = upload(file);
  v1::RestoreSessionRequest restore;
  restore.set_request_id("the same request");
  restore.mutable_snapshot()->set_upload(name);
  v1::RestoreSessionResponse made;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->RestoreSession(&context, restore, &made).ok());
  v1::RestoreSessionResponse again;
  grpc::ClientContext repeated;
  ASSERT_TRUE(stub_->RestoreSession(&repeated, restore, &again).ok());
  EXPECT_EQ(again.session().name(), made.session().name());
  EXPECT_EQ(again.writer_token(), made.writer_token());
}

TEST_F(SnapshotTest, NoChangedOrCutOffFileIsTaken) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  take(session, everything(mesh));
  const std::string file = snapshot(session);
  std::minstd_rand random(7);
  for (int k = 0; k < 150; ++k) {
    std::string changed = file;
    const std::size_t at = k < 24 ? static_cast<std::size_t>(k) : random() % file.size();
    changed[at] = static_cast<char>(changed[at] ^ (1 << random() % 8));
    const std::string reason = refusal(changed);
    EXPECT_TRUE(absl::StartsWith(reason, "SNAPSHOT_")) << reason << " at " << at;
  }
  for (std::size_t size = 8; size < file.size(); size += size < 40 ? 1 : file.size() / 50) {
    EXPECT_EQ(refusal(file.substr(0, size)), "SNAPSHOT_TRUNCATED") << size;
  }
  EXPECT_EQ(refusal(file + "x"), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(sessions(), 1);
}

TEST_F(SnapshotTest, AForeignANewerAndAnEmptyFileAreRefusedByName) {
  const std::string file = snapshot(create(bar_mesh()));
  EXPECT_EQ(refusal("ply\nformat ascii 1.0\n"), "SNAPSHOT_FOREIGN");
  EXPECT_EQ(refusal(std::string(1000, '\0')), "SNAPSHOT_FOREIGN");
  EXPECT_EQ(refusal(""), "SNAPSHOT_FOREIGN");
  std::string newer = file;
  newer[8] = kSnapshotFormat + 1;
  EXPECT_EQ(refusal(newer), "SNAPSHOT_NEWER");
  newer[8] = 0;
  EXPECT_EQ(refusal(newer), "SNAPSHOT_DAMAGED");
  v1::CreateSessionResponse session;
  v1::RestoreSessionRequest request;
  v1::RestoreSessionResponse response;
  grpc::ClientContext context;
  EXPECT_EQ(details_of(stub_->RestoreSession(&context, request, &response)).info.reason(), "BUFFER_MISSING");
}

TEST_F(SnapshotTest, AFileThatSomebodyMadeUpIsHeldToEveryLimit) {
  options_.max_vertices = 1000;
  options_.max_handles = 8;
  options_.max_undo = 3;
  restart();
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  take(session, everything(mesh));
  const std::string file = snapshot(session);
  ASSERT_EQ(sealed(opened(file)).size(), file.size());
  using Change = std::function<void(stored::Snapshot&)>;
  const auto reason = [&](const Change& change) {
    stored::Snapshot snapshot = opened(file);
    change(snapshot);
    return refusal(sealed(snapshot));
  };
  EXPECT_EQ(reason([](auto& s) { s.mutable_parts()->erase("p"); }), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(reason([](auto& s) { (*s.mutable_parts())["inputs"] = "\xff\xff"; }), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(reason([](auto& s) { s.clear_head(); }), "BUFFER_MISSING");
  EXPECT_EQ(
      reason([](auto& s) { s.mutable_head()->mutable_request()->mutable_mesh()->set_vertex_count(5000); }),
      "MESH_TOO_LARGE");
  EXPECT_EQ(
      reason([](auto& s) { s.mutable_head()->mutable_request()->mutable_mesh()->set_vertex_count(300); }),
      "BUFFER_SIZE");
  EXPECT_EQ(reason([](auto& s) {
              std::string& data =
                  *s.mutable_head()->mutable_request()->mutable_mesh()->mutable_data()->mutable_inline_();
              data.replace(data.size() - 4, 4, "\xff\xff\xff\x7f");
            }),
            "MESH_INDEX_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) {
              std::string& data = *s.mutable_surface()->mutable_data()->mutable_inline_();
              data.assign(370 * 24, '\xff');
              s.mutable_surface()->set_scalar(v1::SCALAR_FLOAT64);
            }),
            "POSITIONS_NOT_FINITE");
  EXPECT_EQ(reason([](auto& s) { s.mutable_surface()->mutable_data()->set_inline_("short"); }),
            "BUFFER_SIZE");
  EXPECT_EQ(reason([](auto& s) {
              change_part<v1::Field>(s, "p", [](auto& p) { p.mutable_automatic()->set_strength(1); });
            }),
            "SNAPSHOT_DAMAGED");
  EXPECT_EQ(reason([](auto& s) { change_part<v1::Field>(s, "p", [](auto& p) { p.set_uniform(0.5); }); }),
            "P_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) {
              change_part<stored::Inputs>(s, "inputs", [](auto& i) { i.set_input_seq(~std::uint64_t{0}); });
            }),
            "INPUT_SEQ_TOO_HIGH");
  EXPECT_EQ(reason([](auto& s) {
              change_part<stored::Inputs>(s, "inputs",
                                          [](auto& i) { i.set_history_steps(~std::uint64_t{0}); });
            }),
            "SNAPSHOT_DAMAGED");
  EXPECT_EQ(reason([](auto& s) {
              change_part<stored::Group>(s, "g:soft", [](auto& g) {
                g.mutable_handle()->mutable_vertices()->set_inline_(packed(std::vector<std::int32_t>{371}));
              });
            }),
            "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) {
              change_part<stored::Removals>(s, "removed", [](auto& r) {
                for (int k = 0; k < 100; ++k) (*r.mutable_input_seqs())["gone" + std::to_string(k)] = 1;
              });
            }),
            "TOO_MANY_HANDLES");
  EXPECT_EQ(sessions(), 1);
}

TEST_F(SnapshotTest, AFileThatWouldBecomeManyTimesAsLargeIsRefusedBeforeItIsParsed) {
  options_.max_bytes = 32 << 20;
  restart();
  const std::string file = snapshot(create(bar_mesh()));
  constexpr int kMany = 200'000;  // of two bytes each
  using Change = std::function<void(stored::Snapshot&)>;
  const auto reason = [&](const Change& change) {
    stored::Snapshot snapshot = opened(file);
    change(snapshot);
    v1::CreateSessionResponse session;
    const std::string made_up = sealed(snapshot);
    EXPECT_LT(made_up.size(), kMostInline);
    return details_of(try_restore(made_up, session)).info.reason();
  };
  EXPECT_EQ(reason([](auto& s) {
              for (int k = 0; k < kMany; ++k) s.mutable_head()->mutable_request()->add_handles();
            }),
            "MEMORY_FULL");
  EXPECT_EQ(reason([](auto& s) {
              stored::Step step;
              for (int k = 0; k < kMany; ++k) step.add_changes();
              (*s.mutable_parts())["s:0"] = step.SerializeAsString();
            }),
            "MEMORY_FULL");
  EXPECT_EQ(reason([](auto& s) {  // fields that nobody knows
              std::string unknown;
              for (int k = 0; k < 2 * kMany; ++k) unknown += "\x78\x01";
              s.mutable_surface()->ParseFromString(s.surface().SerializeAsString() + unknown);
            }),
            "MEMORY_FULL");
  restored(file);
}

TEST_F(SnapshotTest, WhatAMessageTakesParsedIsFoundInItsBytes) {
  v1::CreateSessionRequest request;
  const auto estimated = [&] {
    return parsed_size(*v1::CreateSessionRequest::descriptor(), request.SerializeAsString());
  };
  for (int k = 0; k < 1000; ++k) {
    v1::HandleUpdate& handle = *request.add_handles();
    handle.set_name("a name that is too long to lie in the text itself");
    if (k % 3 == 0) handle.mutable_set()->mutable_soft()->set_weight(1);
    if (k % 3 == 1) handle.mutable_move()->mutable_rigid()->mutable_center()->set_x(1);
    if (k % 3 == 2) handle.mutable_remove();
  }
  EXPECT_GT(estimated(), request.SpaceUsedLong());
  EXPECT_LT(estimated(), 4 * request.SpaceUsedLong());
  request.Clear();
  request.mutable_mesh()->mutable_data()->set_inline_(std::string(1 << 20, 'x'));
  EXPECT_GT(estimated(), 1u << 20);
  EXPECT_LT(estimated(), (1u << 20) + 10'000);  // large buffers are what they are
  const auto of = [](std::string_view bytes) {
    return parsed_size(*v1::CreateSessionRequest::descriptor(), bytes);
  };
  EXPECT_GT(of("\x0b\x08\x01\x0c"), of(""));  // a group
  EXPECT_GT(of("\x0a\xff\xff"), of(""));      // cut off
  EXPECT_GT(of("\xff\xff\xff\xff\xff"), 0u);  // no message at all
}

TEST_F(SnapshotTest, AFileThatCouldNotBeWrittenIsRefused) {
  const auto shape = shape_of(bar_mesh());
  Scheduler scheduler(2);
  SessionParts parts{
      .name = "sessions/1", .shape = shape, .deformer = deformer_of(shape), .beginning = {}, .memory = {}};
  const auto session = Session::create(
      std::move(parts), {scheduler, std::make_shared<ManualTimers>(), std::chrono::seconds(15)});
  ASSERT_TRUE(session.ok());
  const auto file = encode_snapshot(**session);
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(encode_snapshot(**session, file->size()).ok());
  EXPECT_EQ(fault_of(encode_snapshot(**session, 1000).status()).reason, "SNAPSHOT_TOO_LARGE");
}

TEST_F(SnapshotTest, AnUnknownSessionHasNone) {
  std::string file;
  EXPECT_EQ(details_of(try_snapshot("sessions/nonsense", file)).info.reason(), "SESSION_UNKNOWN");
}

TEST_F(SnapshotTest, OneThatOnlyTheStoreHasIsMadeAgainForIt) {
  const auto session = create(bar_mesh());
  take(session, ends_message(bar_mesh().vertices, 1, 2));
  const std::string before = solved(session);
  restart();
  const auto copy = restored(snapshot(session));
  EXPECT_TRUE(solved(copy) == before);
}

TEST_F(SnapshotTest, WithoutMemoryForItThereIsNone) {
  const auto session = create(bar_mesh());
  const std::string file = snapshot(session);
  v1::Session found;
  ASSERT_TRUE(get(session.session().name(), found).ok());
  options_.max_bytes = found.memory_bytes() + file.size();
  options_.store.reset();
  server_.reset();
  faults_.reset();
  start();
  v1::CreateSessionResponse copy;
  EXPECT_EQ(details_of(try_restore(file, copy)).info.reason(), "MEMORY_FULL");
  EXPECT_EQ(sessions(), 0);
}

}  // namespace
}  // namespace lpdeform
