#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "lpdeform/v1/service.grpc.pb.h"
#ifdef LPDEFORM_OVER_WEB
#include <grpcpp/ext/health_check_service_server_builder_option.h>

#include "tests/client/web_front.h"
#endif

namespace lpdeform::client {

/// What a LyingServer says and does, by name:
///   created, opened, framed       vertices of the mesh, in a stream, and in its frame; the truth is 3
///   failures                      calls of CreateSession that it cancels, before one that succeeds
///   hangs, deletion_hangs         1: never answers calls of CreateSession, of DeleteSession
///   is_overloaded, has_better     1: says so in each stream
using Lies = std::map<std::string, int>;

/// A server that violates the contract. Each of its streams has one frame.
class LyingService final : public v1::DeformService::Service {
 public:
  explicit LyingService(const Lies& lies) {
    for (const auto& [name, number] : lies) says_.at(name) = number;
  }

  grpc::Status CreateSession(grpc::ServerContext* context, const v1::CreateSessionRequest*,
                             v1::CreateSessionResponse* response) override {
    ++creations;
    if (says("hangs") == 1) wait_for_end(*context);
    if (creations <= says("failures")) return {grpc::StatusCode::CANCELLED, "The server goes down."};
    response->mutable_session()->set_name("sessions/1");
    response->mutable_session()->mutable_mesh()->set_vertices(says("created"));
    response->set_writer_token("token");
    return grpc::Status::OK;
  }

  grpc::Status GetSession(grpc::ServerContext*, const v1::GetSessionRequest*,
                          v1::GetSessionResponse*) override {
    return grpc::Status::OK;
  }

  grpc::Status DeleteSession(grpc::ServerContext* context, const v1::DeleteSessionRequest*,
                             v1::DeleteSessionResponse*) override {
    ++deletions;
    if (says("deletion_hangs") == 1) wait_for_end(*context);
    return grpc::Status::OK;
  }

  grpc::Status Deform(grpc::ServerContext*,
                      grpc::ServerReaderWriter<v1::DeformResponse, v1::DeformRequest>* stream) override {
    v1::DeformRequest request;
    stream->Read(&request);
    tell<v1::DeformResponse>(*stream);
    while (stream->Read(&request)) {
    }
    return grpc::Status::OK;
  }

  grpc::Status StreamFrames(grpc::ServerContext* context, const v1::StreamFramesRequest*,
                            grpc::ServerWriter<v1::StreamFramesResponse>* stream) override {
    tell<v1::StreamFramesResponse>(*stream);
    wait_for_end(*context);
    return grpc::Status::OK;
  }

  grpc::Status AckFrames(grpc::ServerContext*, const v1::AckFramesRequest*, v1::AckFramesResponse*) override {
    return grpc::Status::OK;
  }

  grpc::Status TakeBetterShape(grpc::ServerContext*, const v1::TakeBetterShapeRequest* request,
                               v1::TakeBetterShapeResponse*) override {
    ++takings;
    return request->writer_token() == "token" ? grpc::Status::OK
                                              : grpc::Status(grpc::StatusCode::INTERNAL, "");
  }

  std::atomic<int> creations = 0, deletions = 0, takings = 0;  // calls

 private:
  int says(const char* name) const { return says_.at(name); }

  static void wait_for_end(const grpc::ServerContext& context) {
    while (!context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  template <typename Response, typename Stream>
  void tell(Stream& stream) const {
    Response response;
    v1::StreamEvent& event = *response.mutable_event();
    event.mutable_opened()->set_vertex_count(says("opened"));
    event.mutable_opened()->set_epoch(1);
    event.mutable_opened()->set_stream_id("streams/1");
    stream.Write(response);
    event.mutable_notice()->set_reason(v1::NOTICE_REASON_OVERLOADED);
    event.mutable_notice()->set_text("Too m\u00fcch to do.");
    if (says("is_overloaded") == 1) stream.Write(response);
    event.mutable_notice()->set_reason(v1::NOTICE_REASON_BETTER_SHAPE);
    event.mutable_notice()->set_energy(-1);
    event.mutable_notice()->set_saved_share(0.25);
    if (says("has_better") == 1) stream.Write(response);
    const int framed = says("framed");
    v1::FramePart& part = *event.mutable_frame();
    part.set_vertex_count(framed);
    part.set_positions(std::string(12 * framed, '\1'));
    part.set_distortion(std::string(4 * framed, '\1'));
    part.set_last(true);
    part.mutable_header()->set_vertex_count(framed);
    part.mutable_header()->set_epoch(1);
    part.mutable_header()->set_is_final(true);
    stream.Write(response);
  }

  Lies says_{{"created", 3}, {"opened", 3},         {"framed", 3},        {"failures", 0},
             {"hangs", 0},   {"deletion_hangs", 0}, {"is_overloaded", 0}, {"has_better", 0}};
};

/// A LyingService on a port; in programs that test gRPC-Web, behind the project's Envoy.
class LyingServer {
 public:
  explicit LyingServer(const Lies& lies) : service_(lies) {
#ifdef LPDEFORM_OVER_WEB
    grpc::EnableDefaultHealthCheckService(true);  // Envoy asks for it
#endif
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
#ifdef LPDEFORM_OVER_WEB
    server_->GetHealthCheckService()->SetServingStatus(v1::DeformService::service_full_name(), true);
    front_ = std::make_unique<WebFront>(address_);
    front_->wait_for_server();
    address_ = front_->address();
#endif
  }
  ~LyingServer() {
    stop();
  }
  LyingServer(const LyingServer&) = delete;
  LyingServer& operator=(const LyingServer&) = delete;

  const std::string& address() const {
    return address_;
  }
  void stop() {
    server_->Shutdown(std::chrono::system_clock::now());
  }

  // How many calls of CreateSession, DeleteSession and TakeBetterShape have come.
  int creations() const {
    return service_.creations;
  }
  int deletions() const {
    return service_.deletions;
  }
  int takings() const {
    return service_.takings;
  }

 private:
  LyingService service_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
#ifdef LPDEFORM_OVER_WEB
  std::unique_ptr<WebFront> front_;
#endif
};

/// A port that takes connections and says nothing.
class SilentServer {
 public:
  SilentServer() {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof place;
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&place), size), 0);
    EXPECT_EQ(listen(listener_, 16), 0);
    EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&place), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(place.sin_port));
  }
  ~SilentServer() { close(listener_); }
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;

  const std::string& address() const { return address_; }

 private:
  const int listener_ = socket(AF_INET, SOCK_STREAM, 0);
  std::string address_;
};

}  // namespace lpdeform::client
