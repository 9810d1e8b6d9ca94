#pragma once

#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/status/status.h"
#include "server/calls/backend.h"
#include "server/runtime/refusals.h"
#include "server/wire/grpc_status.h"

namespace lpdeform {

/// The writing side of a streaming call. One message is under way at a time; the next is made when the
/// previous one is written. `Reactor` is gRPC's. The object keeps itself alive until gRPC is done with it.
/// Operations are started under the lock, so that none follows Finish(). That is safe: gRPC delivers their
/// results from its own threads or its executor, never inside the call that starts them.
template <typename Reactor, typename Response>
class WritePump : public Reactor, public std::enable_shared_from_this<WritePump<Reactor, Response>> {
 public:
  /// Call it once, right after construction.
  void keep(std::shared_ptr<WritePump> self, std::shared_ptr<CallRecord> record) {
    self_ = std::move(self);
    record_ = std::move(record);
  }

  /// Writes the next message, unless a write is under way. On any thread.
  void pump() {
    const std::scoped_lock lock(mutex_);
    pump_locked();
  }

  /// Ends the call with an error as soon as no write is under way. On any thread.
  void refuse(const absl::Status& status) {
    const std::scoped_lock lock(mutex_);
    refuse_locked(status);
  }

  void OnWriteDone(bool ok) final {
    const std::scoped_lock lock(mutex_);
    is_writing_ = false;
    if (ok) on_written(std::chrono::steady_clock::now() - write_began_);
    if (!ok) is_cancelled_ = was_cut_ = true;
    pump_locked();
  }

  void OnCancel() final {
    // Held until the lock is released. gRPC guarantees that order as well, but ThreadSanitizer cannot see it.
    const auto self = this->shared_from_this();
    const std::scoped_lock lock(mutex_);
    is_cancelled_ = true;
    release();
    pump_locked();
  }

  void OnDone() final {
    self_.reset();  // may destroy this object, but not before tasks that need the record are over
  }

 protected:
  enum class Made { kNothing, kMessage, kLastMessage };

  /// Makes the next message. Called with the lock held.
  virtual Made make(Response& response) = 0;

  /// The call is over: release what it holds. Called with the lock held, at least once.
  virtual void release() = 0;

  /// A message has been made, and is about to be written; there may be room for more. Called with the lock held.
  virtual void on_made() {}

  /// gRPC takes the next message. `took`: since it was given this one. Called with the lock held.
  virtual void on_written(std::chrono::duration<double> took) { (void)took; }

  void refuse_locked(const absl::Status& status) {
    if (refusal_.ok()) refusal_ = status;
    pump_locked();
  }

  void pump_locked() {
    if (is_finished_ || is_writing_) return;
    if (is_cancelled_) return finish_locked(absl::CancelledError("The call was cancelled."));
    if (is_last_written_) return finish_locked(absl::OkStatus());
    if (!refusal_.ok()) return finish_locked(refusal_);
    response_.Clear();
    const Made made = make(response_);
    if (made == Made::kNothing) return;
    is_writing_ = true;
    write_began_ = std::chrono::steady_clock::now();
    is_last_written_ = made == Made::kLastMessage;
    record_->sent(response_.ByteSizeLong());
    on_made();
    this->StartWrite(&response_);
  }

  CallRecord& record() const { return *record_; }
  const CallContext& context() const { return record_->context(); }

  bool is_over_locked() const { return is_finished_ || is_cancelled_; }

  CallEnd how_ended_locked() const {
    CallEnd end;
    end.is_refused = !refusal_.ok();
    if (is_writing_ || was_cut_) end.unread = std::chrono::steady_clock::now() - write_began_;
    return end;
  }

  std::mutex mutex_;

 private:
  void finish_locked(const absl::Status& status) {
    if (std::exchange(is_finished_, true)) return;
    release();
    record_->ended(status);
    this->Finish(to_grpc(status));
  }

  std::shared_ptr<WritePump> self_;
  std::shared_ptr<CallRecord> record_;
  Response response_;
  absl::Status refusal_;
  bool is_writing_ = false;
  bool was_cut_ = false;  // the call was cut in the middle of a write
  std::chrono::steady_clock::time_point write_began_;
  bool is_last_written_ = false;
  bool is_cancelled_ = false;
  bool is_finished_ = false;
};

/// Makes a call and begins it with `arguments`, or refuses it if the server drains. The call belongs to gRPC.
template <typename Call, typename... Arguments>
Call* begin_call(Backend& backend, std::shared_ptr<CallRecord> record, const Arguments&... arguments) {
  const auto call = std::make_shared<Call>(backend);
  const bool is_let_in = record->is_let_in();
  (record->received(arguments.ByteSizeLong()), ...);
  call->keep(call, std::move(record));
  if (is_let_in) {
    call->begin(arguments...);
  } else {
    call->refuse(server_draining());
  }
  return call.get();
}

}  // namespace lpdeform
