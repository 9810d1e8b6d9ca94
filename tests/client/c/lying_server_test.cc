// How the C interface handles a server that violates the contract.

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lpdeform/v1/service.grpc.pb.h"
#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

/// Says of every mesh that it has `created`, in a stream `opened`, and of every frame `framed` vertices.
class LyingServer final : public v1::DeformService::Service {
 public:
  grpc::Status CreateSession(grpc::ServerContext* context, const v1::CreateSessionRequest*,
                             v1::CreateSessionResponse* response) override {
    ++calls;
    while (hangs && !context->IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (calls <= failures) return {grpc::StatusCode::CANCELLED, "The server goes down."};
    response->mutable_session()->set_name("sessions/1");
    response->mutable_session()->mutable_mesh()->set_vertices(created);
    response->set_writer_token("token");
    return grpc::Status::OK;
  }

  grpc::Status DeleteSession(grpc::ServerContext* context, const v1::DeleteSessionRequest*,
                             v1::DeleteSessionResponse*) override {
    ++deletions;
    while (deletion_hangs && !context->IsCancelled())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return grpc::Status::OK;
  }

  grpc::Status Deform(grpc::ServerContext*,
                      grpc::ServerReaderWriter<v1::DeformResponse, v1::DeformRequest>* stream) override {
    v1::DeformRequest request;
    stream->Read(&request);
    v1::DeformResponse response;
    response.mutable_event()->mutable_opened()->set_vertex_count(opened);
    response.mutable_event()->mutable_opened()->set_epoch(1);
    stream->Write(response);
    response.mutable_event()->mutable_notice()->set_reason(v1::NOTICE_REASON_OVERLOADED);
    response.mutable_event()->mutable_notice()->set_text("Too m\u00fcch to do.");
    if (is_overloaded) stream->Write(response);
    response.mutable_event()->mutable_notice()->set_reason(v1::NOTICE_REASON_BETTER_SHAPE);
    response.mutable_event()->mutable_notice()->set_energy(-1);
    response.mutable_event()->mutable_notice()->set_saved_share(0.25);
    if (has_better) stream->Write(response);
    v1::FramePart& part = *response.mutable_event()->mutable_frame();
    part.set_vertex_count(framed);
    part.set_positions(std::string(12 * framed, '\1'));
    part.set_distortion(std::string(4 * framed, '\1'));
    part.set_last(true);
    part.mutable_header()->set_vertex_count(framed);
    part.mutable_header()->set_epoch(1);
    part.mutable_header()->set_is_final(true);
    stream->Write(response);
    while (stream->Read(&request)) {
    }
    return grpc::Status::OK;
  }

  grpc::Status TakeBetterShape(grpc::ServerContext*, const v1::TakeBetterShapeRequest* request,
                               v1::TakeBetterShapeResponse*) override {
    ++takings;
    return request->writer_token() == "token" ? grpc::Status::OK
                                              : grpc::Status(grpc::StatusCode::INTERNAL, "");
  }

  std::uint32_t created = 3, opened = 3, framed = 3;
  std::atomic<int> calls = 0, deletions = 0, takings = 0;
  int failures = 0;
  bool hangs = false, deletion_hangs = false, is_overloaded = false, has_better = false;
};

class LyingServerTest : public testing::Test {
 protected:
  LyingServerTest() { error_.struct_size = sizeof error_; }

  ~LyingServerTest() override {
    lpdeform_disconnect(client_);
    lpdeform_close(session_);
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
  }

  void start() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    open("127.0.0.1:" + std::to_string(port));
  }

  void open(const std::string& address) {
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = address.c_str();
    connection.connect_timeout_seconds = connection.call_timeout_seconds =
        1e6;  // longer than any test may take
    ASSERT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK) << error_.message;
    const lpdeform_mesh mesh = triangle_.mesh();
    ASSERT_EQ(lpdeform_open(client_, &mesh, nullptr, &session_, &error_), LPDEFORM_OK) << error_.message;
  }

  lpdeform_state state() { return lpdeform_session_state(session_, &error_); }

  /// A buffer for three vertices, before others that nobody may write to.
  lpdeform_buffers three_of(std::vector<Point>& points) {
    lpdeform_buffers buffers = buffers_of(points);
    buffers.positions.bytes = 3 * sizeof(Point);
    return buffers;
  }

  LyingServer service_;
  std::unique_ptr<grpc::Server> server_;
  Triangle triangle_;
  lpdeform_client* client_ = nullptr;
  lpdeform_session* session_ = nullptr;
  lpdeform_error error_{};
};

TEST_F(LyingServerTest, TheTruthIsTaken) {
  start();
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK)
      << error_.message;
}

TEST_F(LyingServerTest, WhatAServerSaysAboutItselfIsHandedOnAndCutWhereThereIsNoRoom) {
  service_.is_overloaded = true;
  start();
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK);
  const auto said = [&](std::size_t bytes) {
    std::vector<char> text(bytes + 1, '#');
    EXPECT_EQ(lpdeform_session_notice(session_, text.data(), bytes), LPDEFORM_NOTICE_OVERLOADED);
    EXPECT_EQ(text.back(), '#');  // nobody writes beyond
    return std::string(text.data(), std::find(text.begin(), text.end(), '\0') - text.begin());
  };
  EXPECT_EQ(said(100), "Too m\u00fcch to do.");
  EXPECT_EQ(said(17), "Too m\u00fcch to do.");
  EXPECT_EQ(said(11), "Too m\u00fc...");
  EXPECT_EQ(said(10), "Too m...");  // and not half of a character
  EXPECT_EQ(said(3), "..");
  EXPECT_EQ(said(1), "");
  EXPECT_EQ(said(0), "#");
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_OVERLOADED);
  EXPECT_EQ(lpdeform_session_notice(nullptr, nullptr, 0), LPDEFORM_NOTICE_NONE);
  server_->Shutdown(std::chrono::system_clock::now());
  server_.reset();
  EXPECT_TRUE(
      eventually([&] { return lpdeform_session_notice(session_, nullptr, 0) == LPDEFORM_NOTICE_NONE; }));
}

TEST_F(LyingServerTest, ABetterShapeIsToldWithItsNumbersAndNoMoreOnceItIsTaken) {
  service_.is_overloaded = service_.has_better = true;
  start();
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_BETTER_SHAPE);
  lpdeform_better_shape better{};
  better.struct_size = sizeof better;
  EXPECT_EQ(lpdeform_session_better_shape(session_, &better, &error_), LPDEFORM_OK);
  EXPECT_EQ(better.energy, -1);
  EXPECT_EQ(better.saved_share, 0.25);
  EXPECT_EQ(lpdeform_session_better_shape(session_, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_take_better_shape(session_, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(service_.takings, 1);
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_OVERLOADED);
  EXPECT_EQ(lpdeform_session_better_shape(session_, &better, &error_), LPDEFORM_NO_FRAME);
  EXPECT_EQ(lpdeform_session_better_shape(nullptr, &better, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_take_better_shape(nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(LyingServerTest, ClosingDoesNotWaitForAServerThatHangs) {
  service_.deletion_hangs = true;
  start();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_LIVE; }));
  lpdeform_close(std::exchange(session_, nullptr));
  lpdeform_disconnect(
      std::exchange(client_, nullptr));  // the timeout of calls is longer than this test may take
  EXPECT_EQ(service_.deletions, 1);
}

TEST_F(LyingServerTest, ASessionOfAnotherMeshIsRefused) {
  service_.created = 4;
  start();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_DATA_LOSS);
  EXPECT_STREQ(error_.reason, "FRAME_VERTICES");
}

TEST_F(LyingServerTest, AStreamOfAnotherMeshIsRefused) {
  service_.opened = service_.framed = 4;
  start();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_STREQ(error_.reason, "FRAME_VERTICES");
  EXPECT_STREQ(error_.limit, "vertices = 3");
  std::vector<Point> points(9, Point{7, 7, 7});
  const lpdeform_buffers buffers = three_of(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, nullptr, &error_), LPDEFORM_DATA_LOSS);
  EXPECT_EQ(points, std::vector<Point>(9, Point{7, 7, 7}));
}

TEST_F(LyingServerTest, AFrameOfAnotherMeshIsDroppedAndSaidByTheState) {
  service_.framed = 4;
  start();
  std::vector<Point> points(9, Point{7, 7, 7});
  const lpdeform_buffers buffers = three_of(points);
  EXPECT_TRUE(eventually([&] {
    EXPECT_EQ(lpdeform_poll(session_, &buffers, nullptr, &error_), LPDEFORM_NO_FRAME) << error_.message;
    return state() != LPDEFORM_STATE_LIVE && std::string(error_.reason) == "FRAME_PARTS";
  }));
  EXPECT_EQ(error_.code, LPDEFORM_DATA_LOSS);
  EXPECT_EQ(points, std::vector<Point>(9, Point{7, 7, 7}));
}

TEST_F(LyingServerTest, ACallThatTheServerCancelsIsMadeAgain) {
  service_.failures = 2;
  start();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_LIVE; })) << error_.message;
  EXPECT_EQ(service_.calls, 3);
}

TEST_F(LyingServerTest, DisconnectingGivesUpACallThatIsNeverAnswered) {
  service_.hangs = true;
  start();
  EXPECT_TRUE(eventually([&] { return service_.calls > 0; }));
  lpdeform_disconnect(client_);  // ends at all
  client_ = nullptr;
  EXPECT_EQ(state(), LPDEFORM_STATE_REFUSED);
}

TEST_F(LyingServerTest, DisconnectingGivesUpConnectionsThatAreNeverMade) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);  // takes connections and says nothing
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof place;
  ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&place), size), 0);
  ASSERT_EQ(::listen(listener, 16), 0);
  ASSERT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&place), &size), 0);
  open("127.0.0.1:" + std::to_string(ntohs(place.sin_port)));
  std::vector<lpdeform_session*> others(8);
  const lpdeform_mesh mesh = triangle_.mesh();
  for (lpdeform_session*& other : others) {
    ASSERT_EQ(lpdeform_open(client_, &mesh, nullptr, &other, &error_), LPDEFORM_OK);
  }
  EXPECT_EQ(state(), LPDEFORM_STATE_CONNECTING);
  lpdeform_disconnect(client_);
  client_ = nullptr;
  for (lpdeform_session* const other : others) lpdeform_close(other);
  close(listener);
}

}  // namespace
}  // namespace lpdeform::engine
