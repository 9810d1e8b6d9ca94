#include "client/cpp/link.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "client/cpp/guarded.h"
#include "client/cpp/upload.h"
#include "client/cpp/wire.h"

namespace lpdeform::client {
namespace {

v1::DeformRequest open_request(const Lease& lease, const OpenOptions& options) {
  v1::DeformRequest request;
  v1::DeformOpen& open = *request.mutable_open();
  open.set_session(lease.session);
  open.set_writer_token(lease.writer_token);
  v1::FrameOptions& frames = *open.mutable_options();
  frames.set_credit(options.credit);
  frames.set_scalar(options.double_precision ? v1::SCALAR_FLOAT64 : v1::SCALAR_FLOAT32);
  frames.set_encoding(to_wire(options.encoding));
  frames.set_lowest_encoding(to_wire(std::max(options.encoding, options.lowest_encoding)));
  frames.set_without_distortion(options.without_distortion);
  frames.set_with_normals(options.with_normals);
  frames.set_certify(options.certify);
  frames.set_max_frames_per_second(options.max_frames_per_second);
  return request;
}

}  // namespace

Link::Link(std::shared_ptr<Rpc> rpc, ClientOptions client_options, OpenOptions options, Copy copy,
           Lease lease)
    : rpc_(std::move(rpc)),
      client_options_(client_options),
      options_(std::move(options)),
      copy_(std::move(copy)),
      lease_(std::move(lease)),
      ledger_(copy_.is_bare, rpc_->order()),
      rules_(bool{copy_}, client_options_.reconnect_for),
      request_id_(new_request_id()) {
  ledger_.count_from(lease_.input_seq);
  ledger_.begin_epoch(lease_.epoch);
}

Link::~Link() {
  close().IgnoreError();
}

void Link::start_stream() {
  const std::scoped_lock lock(mutex_);
  if (is_running_ || is_closing_ || thread_.joinable()) return;
  last_open_ = Clock::now();
  thread_ = std::thread([this] { run(); });
  is_running_ = true;
}

void Link::run() {
  const absl::Status failed = guarded([this] {
    while (recover(one_stream())) {
    }
    return absl::OkStatus();
  });
  if (failed.ok()) return;
  const std::scoped_lock lock(mutex_);
  is_open_ = false;
  give_up(failed);
}

absl::Status Link::one_stream() {
  const std::unique_ptr<DeformCall> call = rpc_->deform();
  const auto forget = absl::MakeCleanup([this] {
    const std::scoped_lock lock(mutex_);
    call_ = nullptr;
  });
  v1::DeformRequest open;
  assembly_.reset();
  {
    const std::scoped_lock lock(mutex_);
    trying_ = std::stop_source();
    if (is_closing_) call->cancel();
    call_ = call.get();
    ++stream_;
    is_open_ = is_over_ = is_to_reopen_ = false;
    ack_due_.reset();
    uploads_in_use_.clear();  // the server's copies expire
    uploads_done_.clear();
    go_away_.reset();
    notice_.reset();
    better_.reset();
    broken_ = unsent_ = absl::OkStatus();
    last_heard_ = Clock::now();
    open = open_request(lease_, options_);
  }
  std::thread reader([this, &call] { listen(*call); });
  const absl::Status pumped = guarded([&] {
    if (call->write(open)) pump(*call);
    return absl::OkStatus();
  });
  if (!pumped.ok()) call->cancel();
  reader.join();
  const absl::Status ended = call->finish();
  const std::scoped_lock lock(mutex_);
  if (!pumped.ok()) return pumped;
  if (!broken_.ok()) return broken_;
  return unsent_.ok() ? ended : unsent_;
}

void Link::pump(DeformCall& call) {
  std::unique_lock lock(mutex_);
  while (!is_over_) {
    if (is_open_ && send_one(call, lock)) continue;
    const auto has_work = [this] {
      return is_over_ ||
             (is_open_ && (ack_due_ || !uploads_done_.empty() || (!is_solving_ && ledger_.can_send())));
    };
    const Clock::time_point heard = last_heard_;
    if (changed_.wait_until(lock, heard + longest_silence_, has_work) || last_heard_ != heard) continue;
    call.cancel();
    changed_.wait(lock, [this] { return is_over_; });
  }
}

/// Sends one message if any is due; false if none is. `lock` is released meanwhile.
bool Link::send_one(DeformCall& call, std::unique_lock<std::mutex>& lock) {
  if (ack_due_) {
    v1::DeformRequest request;
    request.mutable_ack()->set_frame_seq(*std::exchange(ack_due_, std::nullopt));
    lock.unlock();
    call.write(request);
    lock.lock();
    return true;
  }
  if (!is_solving_ && ledger_.can_send()) {
    send_update(call, ledger_.send_next(), lock);
    return true;
  }
  if (uploads_done_.empty()) return false;
  std::vector<Uploads> done = std::exchange(uploads_done_, {});
  lock.unlock();
  for (Uploads& uploads : done) uploads.discard();
  lock.lock();
  return true;
}

void Link::send_update(DeformCall& call, const NumberedUpdate& update, std::unique_lock<std::mutex>& lock) {
  const std::stop_token stop = trying_.get_token();
  lock.unlock();
  v1::DeformRequest request;
  Uploads uploads(*rpc_, stop);
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  const absl::Status packed = to_wire(update.update, update.seq, packer, *request.mutable_update());
  if (packed.ok() && !uploads.empty()) {
    const std::scoped_lock keeping(mutex_);
    uploads_in_use_.emplace(update.seq, std::move(uploads));
  }
  if (packed.ok()) call.write(request);
  lock.lock();
  if (packed.ok()) return;
  const Answer answer = judge(update.seq, packed);
  if (answer == Answer::kAgain || answer == Answer::kRecreate) {
    if (!is_over_) unsent_ = packed;  // otherwise the error of the stream says more
    call.cancel();                    // updates in flight then wait for the next stream
    changed_.wait(lock, [this] { return is_over_; });
    return;
  }
  ledger_.refuse(update.seq);
  box_.put_problem(packed);
}

/// After a stream has ended: pauses, and creates the session again if it is lost. False if the session has ended.
bool Link::recover(const absl::Status& ended) {
  std::unique_lock lock(mutex_);
  const Clock::time_point now = Clock::now();
  if (is_open_) last_open_ = now;
  const auto since = [&](Clock::time_point then) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(now - then);
  };
  const Ending ending{ended, go_away_, is_open_ ? since(opened_) : since(now), since(last_open_)};
  is_open_ = false;
  ledger_.connection_lost();
  changed_.notify_all();
  changed_.wait(lock, [this] { return !is_taking_over_ || is_closing_; });
  if (is_closing_) return false;
  if (is_to_reopen_) return true;

  const Recovery recovery = rules_.after(ending);
  last_problem_ = recovery.why;
  if (recovery.next == NextStep::kGiveUp) {
    give_up(recovery.why);
    return false;
  }
  if (!wait_to_try_again(recovery, lock)) return false;
  if (recovery.next == NextStep::kResume || is_to_reopen_) return true;

  const std::string lost = lease_.session;
  lock.unlock();
  const absl::Status made = recreate(lost);
  lock.lock();
  if (made.ok() || is_to_reopen_) return true;
  const Recovery failed = rules_.after_failed_making(made);
  last_problem_ = made;
  if (failed.next == NextStep::kRecreate) return wait_to_try_again(failed, lock);
  give_up(made);
  return false;
}

/// Waits before the next attempt, for recovery.pause. If the server was unreachable and a connection comes back
/// meanwhile, waits only for recovery.asked. Returns at once if the session was taken over. False if the session is to
/// be closed.
bool Link::wait_to_try_again(const Recovery& recovery, std::unique_lock<std::mutex>& lock) {
  const auto is_woken = [this] { return is_closing_ || is_to_reopen_; };
  if (is_woken()) return !is_closing_;
  trying_ = std::stop_source();
  const std::stop_token stop = trying_.get_token();
  const Clock::time_point start = Clock::now();
  lock.unlock();
  const Rpc::Connected connected = absl::IsUnavailable(recovery.why)
                                       ? rpc_->wait_for_connection(recovery.pause, stop)
                                       : Rpc::Connected::kWas;
  lock.lock();
  const auto pause = connected == Rpc::Connected::kCame ? recovery.asked : recovery.pause;
  changed_.wait_until(lock, start + pause, is_woken);
  return !is_closing_;
}

void Link::give_up(absl::Status why) {
  ledger_.drop_unaccepted();
  is_running_ = false;
  if (why.ok()) why = absl::UnavailableError("The server ended the stream.");
  box_.finish(std::move(why));
}

}  // namespace lpdeform::client
