#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cpp/link.h"
#include "client/cpp/status_details.h"
#include "core/base/fault.h"
#include "tests/client/fake_rpc.h"

namespace lpdeform::client {

// Shared by tests of a session against a server whose every message they choose.

inline constexpr std::uint32_t kVertexCount = 2;

class LinkTest : public testing::Test {
 protected:
  void open(std::size_t face_count = 1) {
    Mesh mesh{std::vector<double>(3 * kVertexCount), std::vector<std::uint32_t>(3 * face_count)};
    auto lease = create_session(*rpc_, mesh, {}, "id-of-the-first", {});
    ASSERT_TRUE(lease.ok());
    link_ = std::make_unique<Link>(rpc_, ClientOptions(), OpenOptions(),
                                   copy_of(std::move(mesh), OpenOptions()), *std::move(lease));
  }

  /// The stream that the client opens next, answered with StreamOpened.
  std::shared_ptr<Stream> opened_stream(std::uint64_t epoch = 1) {
    EXPECT_TRUE(link_->poll().ok());
    return answered(rpc_->next_stream(), epoch);
  }

  /// `input_seq`: the newest update that the server has.
  std::shared_ptr<Stream> answered(std::shared_ptr<Stream> stream, std::uint64_t epoch = 1,
                                   std::uint64_t input_seq = 0) {
    if (stream == nullptr) return nullptr;
    const auto open = stream->hear();
    EXPECT_TRUE(open && open->has_open());
    if (open) open_ = open->open();
    v1::DeformResponse response;
    response.mutable_event()->mutable_opened()->set_epoch(epoch);
    response.mutable_event()->mutable_opened()->set_vertex_count(kVertexCount);
    response.mutable_event()->mutable_opened()->set_input_seq(input_seq);
    stream->say(response);
    return stream;
  }

  absl::StatusOr<Frame> next_frame() { return link_->next_frame(FrameBox::Clock::now() + kPatience); }

  static Update adding(const std::string& name) {
    Update update;
    update.handles.emplace(name, Handle{{0}, Fixed{}});
    return update;
  }

  const std::shared_ptr<FakeRpc> rpc_ = std::make_shared<FakeRpc>(kVertexCount);
  v1::DeformOpen open_;
  std::unique_ptr<Link> link_;
};

inline v1::DeformResponse frame(std::uint64_t frame_seq, std::uint64_t input_seq, std::uint64_t epoch = 1) {
  v1::DeformResponse response;
  v1::FramePart& part = *response.mutable_event()->mutable_frame();
  part.set_frame_seq(frame_seq);
  part.set_vertex_count(kVertexCount);
  part.set_positions(std::string(kVertexCount * 12, '\0'));
  part.set_last(true);
  v1::FrameHeader& header = *part.mutable_header();
  header.set_frame_seq(frame_seq);
  header.set_input_seq(input_seq);
  header.set_epoch(epoch);
  header.set_vertex_count(kVertexCount);
  header.set_is_final(true);
  return response;
}

inline v1::DeformResponse result(std::uint64_t input_seq, bool is_kept = false) {
  v1::DeformResponse response;
  response.mutable_result()->set_input_seq(input_seq);
  response.mutable_result()->set_kept(is_kept);
  return response;
}

inline v1::DeformResponse refusal(std::uint64_t input_seq) {
  v1::DeformResponse response;
  v1::Fault& fault = *response.mutable_event()->mutable_fault();
  fault.set_code(3);
  fault.set_reason("HANDLE_VERTEX_OUT_OF_RANGE");
  fault.set_element("vertex 9");
  fault.set_input_seq(input_seq);
  return response;
}

/// The same for another reason.
inline v1::DeformResponse fault(std::uint64_t input_seq, absl::StatusCode code, const char* reason,
                                std::uint32_t retry_after_ms = 0) {
  v1::DeformResponse response = refusal(input_seq);
  v1::Fault& fault = *response.mutable_event()->mutable_fault();
  fault.set_code(static_cast<int>(code));
  fault.set_reason(reason);
  fault.set_retry_after_ms(retry_after_ms);
  return response;
}

/// No room, and when there will be.
inline absl::Status full(const char* reason, std::chrono::milliseconds pause) {
  return with_retry_after(carry_fault(absl::StatusCode::kResourceExhausted, {reason, "", ""}, "Full."),
                          pause);
}

inline absl::Status session_unknown() {
  return carry_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "session", ""},
                     "There is no such session.");
}

inline v1::DeformResponse go_away(v1::GoAwayReason reason) {
  v1::DeformResponse response;
  response.mutable_event()->mutable_go_away()->set_reason(reason);
  return response;
}

}  // namespace lpdeform::client
