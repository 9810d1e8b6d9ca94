#include "client/cpp/grpc_web/web_deform_call.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "client/cpp/grpc_web/web_inbox.h"
#include "client/cpp/lease.h"
#include "client/cpp/status_details.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

bool is_not_the_writer(const absl::Status& status) {
  return fault_of(status).reason == Reason::kNotTheWriter;
}

absl::Status not_the_writer() {
  return make_fault(absl::StatusCode::kFailedPrecondition, {Reason::kNotTheWriter, "writer_token", ""},
                    "Another writer took the session over.");
}

v1::DeformResponse fault_about(std::uint64_t seq, const absl::Status& status) {
  v1::DeformResponse response;
  v1::Fault& fault = *response.mutable_event()->mutable_fault();
  const Fault found = fault_of(status);
  fault.set_code(static_cast<int>(status.code()));
  fault.set_reason(found.reason);
  fault.set_text(std::string(status.message()));
  fault.set_element(found.element);
  fault.set_limit(found.limit);
  fault.set_input_seq(seq);
  fault.set_retry_after_ms(static_cast<std::uint32_t>(retry_after(status).count()));
  return response;
}

/// Shared by the caller and by the events of its calls, which may come after it.
class WebStream : public std::enable_shared_from_this<WebStream> {
 public:
  WebStream(Calls calls, std::chrono::milliseconds call_timeout)
      : calls_(std::move(calls)), call_timeout_(call_timeout) {}

  bool write(const v1::DeformRequest& request) {
    if (request.has_open()) open(request.open());
    if (request.has_update()) update(request.update());
    if (request.has_ack()) acknowledge(request.ack().frame_seq());
    const std::scoped_lock lock(mutex_);
    return !is_over_;
  }

  std::optional<v1::DeformResponse> take() {
    return inbox_.take([this] {
      const std::scoped_lock lock(mutex_);
      if (stream_) stream_->resume();
    });
  }

  absl::Status status() const { return inbox_.status(); }

  void end(const absl::Status& status) {
    const std::scoped_lock lock(mutex_);
    if (std::exchange(is_over_, true)) return;
    if (stream_) stream_->cancel();
    for (const std::shared_ptr<HttpCall>& call : under_way_) call->cancel();
    under_way_.clear();
    inbox_.end(status);
  }

 private:
  struct Answer {
    std::uint64_t seq = 0;
    std::optional<v1::DeformResponse> response;
  };

  void open(const v1::DeformOpen& open) {
    v1::StreamFramesRequest request;
    request.set_session(open.session());
    *request.mutable_options() = open.options();
    const std::scoped_lock lock(mutex_);
    if (is_over_) return;
    session_ = open.session();
    writer_token_ = open.writer_token();
    const auto self = shared_from_this();
    stream_ = calls_.start("StreamFrames", request, std::chrono::milliseconds(0),
                           {.has_room = [self] { return self->inbox_.has_room(); },
                            .message = [self](const std::string& message) { self->take_event(message); },
                            .end = [self](const absl::Status& status) { self->end(status); }});
  }

  void take_event(const std::string& message) {
    v1::StreamFramesResponse response;
    if (!response.ParseFromString(message)) return end(absl::InternalError("A message cannot be read."));
    const v1::StreamEvent& event = response.event();
    bool is_replaced = false;
    {
      const std::scoped_lock lock(mutex_);
      if (event.has_opened()) {
        stream_id_ = event.opened().stream_id();
        epoch_ = event.opened().epoch();
      }
      is_replaced = event.has_frame() && event.frame().header().epoch() > epoch_ && !writer_token_.empty();
    }
    if (is_replaced) return end(not_the_writer());
    v1::DeformResponse out;
    out.mutable_event()->Swap(response.mutable_event());
    inbox_.put(std::move(out), message.size());
  }

  void update(const v1::Update& update) {
    v1::UpdateHandlesRequest request;
    request.set_session(session_);
    request.set_writer_token(writer_token_);
    *request.mutable_update() = update;
    const std::uint64_t seq = update.input_seq();
    const auto self = shared_from_this();
    const std::scoped_lock lock(mutex_);
    if (is_over_) return;
    answers_.push_back({seq, std::nullopt});
    const auto response = std::make_shared<v1::UpdateHandlesResponse>();
    keep(calls_.start(
        "UpdateHandles", request, call_timeout_,
        {.has_room = {},
         .message = [response](const std::string& message) { response->ParseFromString(message); },
         .end = [self, seq,
                 response](const absl::Status& status) { self->answered(seq, status, *response); }}));
  }

  void answered(std::uint64_t seq, const absl::Status& status, const v1::UpdateHandlesResponse& taken) {
    if (is_session_lost(status)) return end(status);
    if (is_not_the_writer(status)) return end(not_the_writer());
    v1::DeformResponse response;
    if (status.ok()) {
      *response.mutable_result() = taken.result();
      response.mutable_result()->set_input_seq(seq);
    } else {
      response = fault_about(seq, status);
    }
    const std::scoped_lock lock(mutex_);
    const auto place = std::ranges::find(answers_, seq, &Answer::seq);
    if (place == answers_.end()) return;
    place->response = std::move(response);
    while (!answers_.empty() && answers_.front().response) {
      inbox_.put(*std::move(answers_.front().response), 0);
      answers_.pop_front();
    }
  }

  void acknowledge(std::uint64_t frame_seq) {
    const std::scoped_lock lock(mutex_);
    ack_due_ = std::max(ack_due_, frame_seq);
    send_ack();
  }

  /// One call at a time, for the newest frame. Called with the lock held.
  void send_ack() {
    if (is_over_ || is_acking_ || ack_due_ <= ack_sent_ || stream_id_.empty()) return;
    is_acking_ = true;
    ack_sent_ = ack_due_;
    v1::AckFramesRequest request;
    request.set_session(session_);
    request.set_stream_id(stream_id_);
    request.set_frame_seq(ack_sent_);
    const auto self = shared_from_this();
    keep(calls_.start("AckFrames", request, call_timeout_,
                      {.has_room = {},
                       .message = [](const std::string&) {},
                       .end = [self](const absl::Status& status) { self->acknowledged(status); }}));
  }

  /// Without credit, the stream would stay silent.
  void acknowledged(const absl::Status& status) {
    if (is_session_lost(status)) return end(status);
    if (!status.ok()) return end(absl::UnavailableError(status.message()));
    const std::scoped_lock lock(mutex_);
    is_acking_ = false;
    send_ack();
  }

  /// For end(). There are never many: two updates and an acknowledgement, and some that have ended.
  void keep(std::shared_ptr<HttpCall> call) {
    under_way_.push_back(std::move(call));
    if (under_way_.size() > kMostKept) under_way_.pop_front();
  }
  static constexpr std::size_t kMostKept = 16;

  const Calls calls_;
  const std::chrono::milliseconds call_timeout_;
  Inbox<v1::DeformResponse> inbox_;
  std::mutex mutex_;
  bool is_over_ = false;
  std::shared_ptr<HttpCall> stream_;
  std::deque<std::shared_ptr<HttpCall>> under_way_;
  std::string session_, writer_token_, stream_id_;
  std::uint64_t epoch_ = 0;
  std::deque<Answer> answers_;  // in the order of writing
  std::uint64_t ack_due_ = 0, ack_sent_ = 0;
  bool is_acking_ = false;
};

class WebDeformCall final : public DeformCall {
 public:
  WebDeformCall(std::shared_ptr<Http> http, Caller caller, std::chrono::milliseconds call_timeout)
      : http_(std::move(http)),
        stream_(std::make_shared<WebStream>(Calls(*http_, std::move(caller)), call_timeout)) {}
  ~WebDeformCall() override { cancel(); }

  bool write(const v1::DeformRequest& request) override { return stream_->write(request); }
  bool read(v1::DeformResponse& response) override {
    std::optional<v1::DeformResponse> taken = stream_->take();
    if (taken) response = *std::move(taken);
    return taken.has_value();
  }
  void cancel() override { stream_->end(absl::CancelledError("The call was cancelled.")); }
  absl::Status finish() override { return stream_->status(); }

 private:
  const std::shared_ptr<Http> http_;
  const std::shared_ptr<WebStream> stream_;
};

}  // namespace

std::unique_ptr<DeformCall> deform_by_web(std::shared_ptr<Http> http, Caller caller,
                                          std::chrono::milliseconds call_timeout) {
  return std::make_unique<WebDeformCall>(std::move(http), std::move(caller), call_timeout);
}

}  // namespace lpdeform::client
