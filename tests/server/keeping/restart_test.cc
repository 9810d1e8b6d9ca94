// A server with a store, and its successor.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <thread>

#include "restart_fixture.h"

namespace lpdeform {
namespace {

TEST_F(RestartTest, ASessionHasAllThatItHadToTheLastBit) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  EXPECT_TRUE(take(session, everything(mesh)).kept());
  v1::Update later = tip_message(9, 3);
  later.add_handles()->set_name("soft");
  later.mutable_handles(1)->mutable_remove();
  EXPECT_TRUE(take(session, later).kept());
  const std::string before = seen(session), positions = solved(session);
  restart();
  EXPECT_EQ(seen(session), before);
  EXPECT_TRUE(solved(session) == positions);
}

TEST_F(RestartTest, AWeldedSessionWithNormalsAndARegionIsTheSame) {
  TriangleMesh mesh = bar_mesh();
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(mesh);
  request.mutable_weld()->mutable_position();
  request.set_weights(v1::WEIGHT_KIND_UNIFORM);
  request.set_free_components(v1::FREE_COMPONENTS_STAY);
  Points normals = Points::Zero(mesh.vertices.rows(), 3);
  normals.col(1).setOnes();
  request.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
  request.mutable_normals()->mutable_data()->set_upload(upload(packed(normals)));
  *request.mutable_handles() = ends_message(mesh.vertices, 0, 1).handles();
  std::vector<std::int32_t> region;
  for (std::int32_t v = 0; v < mesh.vertices.rows(); v += 1) {
    if (mesh.vertices(v, 2) > 4) region.push_back(v);
  }
  request.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_(packed(region));
  v1::CreateSessionResponse session;
  ASSERT_TRUE(try_create(request, session).ok());
  const std::string before = seen(session), positions = solved(session);
  restart();
  EXPECT_EQ(seen(session), before);
  EXPECT_TRUE(solved(session) == positions);
}

TEST_F(RestartTest, WhatIsOlderThanAValueIsStaleAfterwardsToo) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  take(session, ends_message(mesh.vertices, 1, 1));
  take(session, tip_message(10, 2));
  v1::Update removal;
  removal.set_input_seq(12);
  set_handle(removal, "gone", vertices_at(mesh.vertices, 5), 0);
  take(session, removal);
  removal.set_input_seq(14);
  removal.mutable_handles(0)->mutable_remove();
  take(session, removal);
  restart();
  EXPECT_EQ(take(session, tip_message(9, 7)).stale_parts(), 1u);
  v1::Update late;
  late.set_input_seq(13);
  set_handle(late, "gone", vertices_at(mesh.vertices, 5), 0);
  EXPECT_EQ(take(session, late).stale_parts(), 1u);
  EXPECT_EQ(take(session, tip_message(15, 7)).stale_parts(), 0u);
}

TEST_F(RestartTest, TheWriterGoesOnInANewEpochAndTheOneBeforeItDoesNot) {
  const auto session = create(bar_mesh());
  v1::AcquireWriterRequest request;
  request.set_session(session.session().name());
  v1::AcquireWriterResponse lease;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->AcquireWriter(&context, request, &lease).ok());
  restart();
  v1::CreateSessionResponse second = session;
  second.set_writer_token(lease.writer_token());
  const v1::Update update = ends_message(bar_mesh().vertices, 1, 1);
  EXPECT_EQ(details_of(this->update(session, update)).info.reason(), "NOT_THE_WRITER");
  DeformClient stream(*stub_, second);
  const auto opened = stream.read();
  ASSERT_TRUE(opened && opened->event().has_opened());
  EXPECT_GT(opened->event().opened().epoch(), lease.epoch());
  EXPECT_TRUE(stream.send(update));
  EXPECT_TRUE(stream.settle(1).has_value());
}

TEST_F(RestartTest, TheSameRequestGivesTheSameSession) {
  v1::CreateSessionRequest request;
  request.set_request_id("the same request");
  *request.mutable_mesh() = mesh_message(bar_mesh());
  v1::CreateSessionResponse first, second;
  ASSERT_TRUE(try_create(request, first).ok());
  restart();
  ASSERT_TRUE(try_create(request, second).ok());
  EXPECT_EQ(second.session().name(), first.session().name());
  EXPECT_EQ(second.writer_token(), first.writer_token());
  request.set_weights(v1::WEIGHT_KIND_UNIFORM);
  EXPECT_EQ(details_of(try_create(request, second)).info.reason(), "REQUEST_ID_REUSED");
}

TEST_F(RestartTest, TheSameRequestRestoresTheSameSessionOnce) {
  const auto session = create(bar_mesh());
  v1::SnapshotSessionRequest snapshot;
  snapshot.set_session(session.session().name());
  grpc::ClientContext taking;
  const auto reader = stub_->SnapshotSession(&taking, snapshot);
  std::string file;
  for (v1::SnapshotSessionResponse part; reader->Read(&part);) file += part.data();
  ASSERT_TRUE(reader->Finish().ok());

  v1::RestoreSessionRequest request;
  request.set_request_id("the same request");
  request.mutable_snapshot()->set_inline_(file);
  const auto restore = [&](v1::RestoreSessionResponse& response) {
    grpc::ClientContext context;
    return stub_->RestoreSession(&context, request, &response);
  };
  v1::RestoreSessionResponse first, second, third;
  ASSERT_TRUE(restore(first).ok());
  restart();
  ASSERT_TRUE(restore(second).ok());
  EXPECT_EQ(second.session().name(), first.session().name());
  EXPECT_EQ(second.writer_token(), first.writer_token());
  restart();
  ASSERT_TRUE(restore(third).ok());
  EXPECT_EQ(third.session().name(), first.session().name());
  v1::ListSessionsResponse all;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->ListSessions(&context, {}, &all).ok());
  EXPECT_EQ(all.sessions_size(), 2);
  request.mutable_snapshot()->set_inline_(file + "x");
  EXPECT_EQ(details_of(restore(third)).info.reason(), "REQUEST_ID_REUSED");
}

TEST_F(RestartTest, ADeletedSessionAndOneThatIsNotThereAreUnknown) {
  const auto session = create(bar_mesh());
  v1::DeleteSessionRequest request;
  request.set_session(session.session().name());
  v1::DeleteSessionResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->DeleteSession(&context, request, &response).ok());
  v1::Session found;
  EXPECT_EQ(details_of(get(session.session().name(), found)).info.reason(), "SESSION_UNKNOWN");
  restart();
  EXPECT_EQ(details_of(get(session.session().name(), found)).info.reason(), "SESSION_UNKNOWN");
  EXPECT_EQ(details_of(get("sessions/nonsense", found)).info.reason(), "SESSION_UNKNOWN");
  grpc::ClientContext again;
  EXPECT_TRUE(stub_->DeleteSession(&again, request, &response).ok());  // deleting twice is fine
}

TEST_F(RestartTest, ManyCallsAtOnceGetOneSession) {
  const auto session = create(bar_mesh());
  restart();
  std::vector<std::thread> threads;
  std::vector<std::uint64_t> epochs(8);
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    threads.emplace_back([&, k] {
      v1::Session found;
      EXPECT_TRUE(get(session.session().name(), found).ok());
      epochs[k] = found.epoch();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(epochs, std::vector<std::uint64_t>(8, session.session().epoch() + kEpochsOfALife));
}

TEST_F(RestartTest, AStreamOfSeveralSessionsFindsThemAll) {
  const auto first = create(bar_mesh()), second = create(bar_mesh());
  restart();
  v1::StreamSessionsRequest request;
  request.add_streams()->set_session(first.session().name());
  request.add_streams()->set_session("sessions/00000000000000000000000000000000");
  request.add_streams()->set_session(second.session().name());
  grpc::ClientContext context;
  const auto reader = stub_->StreamSessions(&context, request);
  std::set<std::uint32_t> opened, faulty;
  v1::StreamSessionsResponse response;
  while (opened.size() < 2 && reader->Read(&response)) {
    if (response.event().has_opened()) opened.insert(response.stream());
    if (response.event().has_fault()) faulty.insert(response.stream());
  }
  context.TryCancel();
  EXPECT_EQ(opened, (std::set<std::uint32_t>{0, 2}));
  EXPECT_EQ(faulty, (std::set<std::uint32_t>{1}));
}

TEST_F(RestartTest, SessionsThatOnlyTheStoreHasAreListedAfterTheOthers) {
  std::set<std::string> names;
  for (int k = 0; k < 5; ++k) names.insert(create(bar_mesh()).session().name());
  restart();
  v1::Session found;
  ASSERT_TRUE(get(*names.begin(), found).ok());
  const auto here = create(bar_mesh());
  names.insert(here.session().name());
  for (const std::uint32_t page_size : {0u, 1u, 2u, 3u, 6u}) {
    v1::ListSessionsRequest request;
    request.set_page_size(page_size);
    std::set<std::string> seen, kept_only;
    do {
      v1::ListSessionsResponse response;
      grpc::ClientContext context;
      ASSERT_TRUE(stub_->ListSessions(&context, request, &response).ok());
      for (const v1::Session& session : response.sessions()) {
        EXPECT_TRUE(seen.insert(session.name()).second) << session.name();
        if (session.is_kept_only()) kept_only.insert(session.name());
        EXPECT_EQ(session.is_kept_only(), session.epoch() == 0);
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    EXPECT_EQ(seen, names);
    EXPECT_EQ(kept_only.size(), 4u);
    EXPECT_FALSE(kept_only.contains(here.session().name()) || kept_only.contains(*names.begin()));
  }
}

TEST_F(RestartTest, OneMeshOfManySessionsIsStoredOnce) {
  for (int k = 0; k < 3; ++k) create(bar_mesh());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_ + "/blobs"),
                          std::filesystem::directory_iterator()),
            1);
}

TEST_F(RestartTest, ASessionThatNobodyUsesGoesFromTheStoreToo) {
  const auto session = create(bar_mesh());
  timers_->advance(options_.session_idle + std::chrono::seconds(1));
  restart();
  v1::Session found;
  EXPECT_EQ(details_of(get(session.session().name(), found)).info.reason(), "SESSION_UNKNOWN");
}

TEST_F(RestartTest, WithoutAStoreNothingIsCalledKept) {
  server_.reset();
  options_.store.reset();
  start();
  const auto session = create(bar_mesh());
  EXPECT_FALSE(take(session, ends_message(bar_mesh().vertices, 1, 1)).kept());
}

}  // namespace
}  // namespace lpdeform
