#include "server/calls/frame_calls.h"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/calls/write_pump.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

/// What calls with one stream of frames have in common.
template <typename Reactor, typename Response>
class FrameCall : public WritePump<Reactor, Response> {
 public:
  explicit FrameCall(Backend& backend) : backend_(backend) {}

 protected:
  using Pump = WritePump<Reactor, Response>;
  using typename Pump::Made;

  /// Opens the stream, on a thread of the pool, once its session is there. Ends the call if that fails.
  void open(
      const std::string& session_name, const std::string& token, const v1::FrameOptions& options,
      const std::function<void()>& then = [] {}) {
    backend_.with_session(this->context(), Backend::Access::kRead, session_name,
                          [self = std::static_pointer_cast<FrameCall>(this->shared_from_this()), token,
                           options, then](const auto& session) {
                            if (!session.ok()) return self->refuse(session.status());
                            self->record().about(*session);
                            self->open_here(*session, token, options);
                            then();
                          });
  }

 private:
  void open_here(const std::shared_ptr<Session>& session, const std::string& token,
                 const v1::FrameOptions& options) {
    auto open =
        backend_.open_stream(this->context(), session, token, options, [weak = this->weak_from_this()] {
          if (const auto self = weak.lock()) self->pump();
        });
    const std::scoped_lock lock(this->mutex_);
    if (!open.ok()) return this->refuse_locked(open.status());
    if (this->is_over_locked()) return backend_.forget(this->context(), *open, this->how_ended_locked());
    open_ = *std::move(open);
    this->pump_locked();
  }

 protected:
  Made make(Response& response) final {
    if (!open_.stream) return Made::kNothing;
    const auto start = std::chrono::steady_clock::now();
    const std::optional<Note> note = open_.stream->next();
    if (!note) return Made::kNothing;
    encode(*note, *open_.stream, open_.session()->vertex_count(), response);
    is_frame_ = std::holds_alternative<FramePiece>(*note);
    if (is_frame_) observe(Span::kFrameEncode, std::chrono::steady_clock::now() - start);
    return std::holds_alternative<EndNote>(*note) ? Made::kLastMessage : Made::kMessage;
  }

  void release() final {
    if (open_.stream && !std::exchange(is_forgotten_, true))
      backend_.forget(this->context(), open_, this->how_ended_locked());
  }

  void on_written(std::chrono::duration<double> took) final {
    if (is_frame_) observe(Span::kFrameWrite, took);
  }

  void observe(Span span, std::chrono::duration<double> took) {
    backend_.metrics->observe(span, took.count());
  }

  Backend& backend_;
  Backend::OpenStream open_;
  bool is_frame_ = false;  // the message that was made last
  bool is_forgotten_ = false;
};

class StreamFramesCall final : public FrameCall<StreamFramesReactor, Outgoing<v1::StreamFramesResponse>> {
 public:
  using FrameCall::FrameCall;

  void begin(const v1::StreamFramesRequest& request) {
    auto self = std::static_pointer_cast<StreamFramesCall>(shared_from_this());
    const auto task = [self, request] { self->open(request.session(), "", request.options()); };
    if (!backend_.pool().try_post(task)) refuse(server_busy(backend_.pool().expected_wait()));
  }
};

class DeformCall final : public FrameCall<DeformReactor, Outgoing<v1::DeformResponse>> {
 public:
  using FrameCall::FrameCall;

  void begin() { post(&DeformCall::let_in); }

  void OnReadDone(bool ok) override {
    bool is_open = true;
    {
      const std::scoped_lock lock(mutex_);
      is_open = is_open_;
      is_open_ = is_open_ || (ok && received_.is_whole && request_.has_open());
    }
    if (!ok) return end_of_input(is_open);
    if (!received_.is_whole) return break_off("The message cannot be parsed; perhaps a string is not UTF-8.");
    record().received(request_.ByteSizeLong());
    switch (request_.message_case()) {
      case v1::DeformRequest::kOpen:
        return is_open ? break_off("The stream was opened twice.") : post(&DeformCall::take_open);
      case v1::DeformRequest::kUpdate:
        return is_open ? post(&DeformCall::take_update) : break_off("The first message is not an open.");
      case v1::DeformRequest::kAck:
        return is_open ? take_ack() : break_off("The first message is not an open.");
      default:
        return break_off("A message is empty, or of a kind that the server does not know.");
    }
  }

 private:
  static constexpr std::size_t kMostAnswers = 64;
  static constexpr std::chrono::seconds kOpenPatience{10};

  /// Reads the next message, unless too many answers wait for the client to read them.
  void read() {
    const std::scoped_lock lock(mutex_);
    read_locked();
  }

  void read_locked() {
    if (is_over_locked()) return;
    is_read_due_ = open_.stream && open_.stream->answers_waiting() + unanswered_ >= kMostAnswers;
    if (!is_read_due_) StartRead(&received_);
  }

  void on_made() override {
    if (is_read_due_) read_locked();
  }

  /// A client that sends no more may still read. A client that never opened a stream has nothing to read.
  void end_of_input(bool is_open) {
    if (!is_open) break_off("The stream ended before it was opened.");
  }

  /// Checks the caller before the first read, because gRPC holds what has come of a message, up to its 4 MiB.
  void let_in() {
    const auto caller = backend_.identify(context(), Backend::Access::kRead);
    if (!caller.ok()) return refuse(caller.status());
    read();
    backend_.timers->at(backend_.timers->now() + kOpenPatience, [weak = weak_from_this()] {
      if (const auto self = std::static_pointer_cast<DeformCall>(weak.lock())) self->give_up_unopened();
    });
  }

  void give_up_unopened() {
    const std::scoped_lock lock(mutex_);
    if (is_open_) return;
    refuse_locked(make_fault({Reason::kStreamUnopened, "", ""}, "The stream was not opened within 10 s."));
  }

  void post(void (DeformCall::*task)()) {
    auto self = std::static_pointer_cast<DeformCall>(shared_from_this());
    if (!backend_.pool().try_post([self, task] { (*self.*task)(); }))
      refuse(server_busy(backend_.pool().expected_wait()));
  }

  void take_open() {
    const v1::DeformOpen& open = request_.open();
    this->open(open.session(), open.writer_token(), open.options(),
               [self = std::static_pointer_cast<DeformCall>(shared_from_this())] { self->read(); });
  }

  void take_update() {
    {
      const std::scoped_lock lock(mutex_);
      ++unanswered_;
    }
    backend_.when_decodable(
        open_.change, request_.update(),
        [self = std::static_pointer_cast<DeformCall>(shared_from_this())](const absl::Status& status) {
          self->give_update(status);
          self->read();
        });
  }

  void give_update(absl::Status status) {
    const v1::Update& update = request_.update();
    const auto answered = [self = std::static_pointer_cast<DeformCall>(shared_from_this()),
                           input = refused_input(update)](const absl::StatusOr<UpdateResult>& result) {
      self->answer(result, input);
    };
    if (!status.ok()) return answered(status);
    backend_.update(context(), open_.change, update, answered);
  }

  /// In this case no answer is sent: the stream ends in a moment, and the client sends an unanswered update
  /// again, to the server that has the session. After a refusal it would not, and the update would be lost.
  static bool goes_on_elsewhere(const absl::Status& status) {
    const std::string reason = fault_of(status).reason;
    return reason == Reason::kDraining || reason == Reason::kSessionElsewhere;
  }

  /// Called on any thread.
  void answer(const absl::StatusOr<UpdateResult>& result, const RefusedInput& input) {
    if (!result.ok()) record().refused(result.status(), input);
    {
      const std::scoped_lock lock(mutex_);
      --unanswered_;
    }
    if (result.ok()) {
      open_.stream->answer(*result);
    } else if (!goes_on_elsewhere(result.status())) {
      open_.stream->answer(FaultNote{result.status(), input.input_seq});
    }
  }

  void take_ack() {
    open_.session()->touch();
    const absl::Status status = open_.stream->acknowledge(request_.ack().frame_seq());
    if (!status.ok()) return break_off(std::string(status.message()));
    read();
  }

  /// The client violates the protocol: reads no more, and tells the client why.
  void break_off(const std::string& why) {
    if (open_.stream) {
      backend_.log().info("stream_misused", {{"session", abbreviated(open_.session()->name())},
                                             {"stream", abbreviated(open_.stream->id())},
                                             {"text", why},
                                             {"trace_id", context().trace_id}});
      return open_.stream->end(EndReason::kProtocolError, why);
    }
    refuse(make_fault({Reason::kStreamProtocol, "", ""}, why));
  }

  Received<v1::DeformRequest> received_;
  const v1::DeformRequest& request_ = received_.message;
  bool is_open_ = false;  // the open message has come
  bool is_read_due_ = false;
  std::size_t unanswered_ = 0;  // updates accepted that are not stored yet
};

}  // namespace

StreamFramesReactor* stream_frames(Backend& backend, std::shared_ptr<CallRecord> record,
                                   const v1::StreamFramesRequest& request) {
  return begin_call<StreamFramesCall>(backend, std::move(record), request);
}

DeformReactor* deform(Backend& backend, std::shared_ptr<CallRecord> record) {
  return begin_call<DeformCall>(backend, std::move(record));
}

}  // namespace lpdeform
