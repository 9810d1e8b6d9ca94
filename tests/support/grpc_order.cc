// Tells ThreadSanitizer in which order gRPC runs its threads. Linked into every program of preset tsan, and into nothing else.
// Debian's gRPC and abseil are not built for ThreadSanitizer: it does not see their locks and queues, and each call would look like
// dozens of races. The functions below replace the libraries' own, which they call: a lock, the two ends of an operation on a
// completion queue, which the tag connects, and the end of a call on the server. They order nothing else, so races in this
// project's code are still found; seeded_callback_race.cc shows it.

#include <absl/synchronization/mutex.h>
#include <dlfcn.h>
#include <grpc/grpc.h>
#include <grpcpp/support/server_callback.h>
#include <sanitizer/tsan_interface.h>

#include <cstdio>
#include <cstdlib>

namespace {

// The library's own function of this name.
template <typename Function>
Function* original(const char* symbol) {
  void* const found = dlsym(RTLD_NEXT, symbol);
  if (found == nullptr) {
    std::fprintf(stderr, "grpc_order.cc: no library has %s any more\n", symbol);
    std::abort();
  }
  return reinterpret_cast<Function*>(found);
}

grpc_event taken(grpc_event event) {
  if (event.type == GRPC_OP_COMPLETE) __tsan_acquire(event.tag);
  return event;
}

}  // namespace

namespace absl {
ABSL_NAMESPACE_BEGIN

void Mutex::Lock() {
  static const auto lock = original<void(Mutex*)>("_ZN4absl7debian35Mutex4LockEv");
  lock(this);
  __tsan_acquire(this);
}

bool Mutex::TryLock() {
  static const auto try_lock = original<bool(Mutex*)>("_ZN4absl7debian35Mutex7TryLockEv");
  const bool is_locked = try_lock(this);
  if (is_locked) __tsan_acquire(this);
  return is_locked;
}

void Mutex::Unlock() {
  static const auto unlock = original<void(Mutex*)>("_ZN4absl7debian35Mutex6UnlockEv");
  __tsan_release(this);
  unlock(this);
}

void CondVar::Wait(Mutex* mutex) {
  static const auto wait = original<void(CondVar*, Mutex*)>("_ZN4absl7debian37CondVar4WaitEPNS0_5MutexE");
  __tsan_release(mutex);
  wait(this, mutex);
  __tsan_acquire(mutex);
}

bool CondVar::WaitWithTimeout(Mutex* mutex, Duration timeout) {
  static const auto wait = original<bool(CondVar*, Mutex*, Duration)>(
      "_ZN4absl7debian37CondVar15WaitWithTimeoutEPNS0_5MutexENS0_8DurationE");
  __tsan_release(mutex);
  const bool is_late = wait(this, mutex, timeout);
  __tsan_acquire(mutex);
  return is_late;
}

bool CondVar::WaitWithDeadline(Mutex* mutex, Time deadline) {
  static const auto wait = original<bool(CondVar*, Mutex*, Time)>(
      "_ZN4absl7debian37CondVar16WaitWithDeadlineEPNS0_5MutexENS0_4TimeE");
  __tsan_release(mutex);
  const bool is_late = wait(this, mutex, deadline);
  __tsan_acquire(mutex);
  return is_late;
}

ABSL_NAMESPACE_END
}  // namespace absl

namespace grpc::internal {

// The library's own code counts a part of a call's outstanding reactions. The thread that counts down to 0 ends the call, and must
// be ordered after what the others did before they counted. The count is the call's third member, after its virtual table and
// another count.
void ServerCallbackCall::ScheduleOnDone(bool is_inline) {
  static const auto schedule =
      original<void(ServerCallbackCall*, bool)>("_ZN4grpc8internal18ServerCallbackCall14ScheduleOnDoneEb");
  __tsan_acquire(reinterpret_cast<char*>(this) + sizeof(void*) + sizeof(std::atomic_int));
  schedule(this, is_inline);
}

}  // namespace grpc::internal

extern "C" {

grpc_call_error grpc_call_start_batch(grpc_call* call, const grpc_op* operations, size_t count, void* tag,
                                      void* reserved) {
  static const auto start = original<decltype(grpc_call_start_batch)>("grpc_call_start_batch");
  __tsan_release(tag);
  return start(call, operations, count, tag, reserved);
}

grpc_call_error grpc_server_request_call(grpc_server* server, grpc_call** call, grpc_call_details* details,
                                         grpc_metadata_array* metadata, grpc_completion_queue* bound,
                                         grpc_completion_queue* notified, void* tag) {
  static const auto request = original<decltype(grpc_server_request_call)>("grpc_server_request_call");
  __tsan_release(tag);
  return request(server, call, details, metadata, bound, notified, tag);
}

void grpc_server_shutdown_and_notify(grpc_server* server, grpc_completion_queue* queue, void* tag) {
  static const auto shut_down =
      original<decltype(grpc_server_shutdown_and_notify)>("grpc_server_shutdown_and_notify");
  __tsan_release(tag);
  shut_down(server, queue, tag);
}

grpc_event grpc_completion_queue_next(grpc_completion_queue* queue, gpr_timespec deadline, void* reserved) {
  static const auto next = original<decltype(grpc_completion_queue_next)>("grpc_completion_queue_next");
  return taken(next(queue, deadline, reserved));
}

grpc_event grpc_completion_queue_pluck(grpc_completion_queue* queue, void* tag, gpr_timespec deadline,
                                       void* reserved) {
  static const auto pluck = original<decltype(grpc_completion_queue_pluck)>("grpc_completion_queue_pluck");
  return taken(pluck(queue, tag, deadline, reserved));
}

}  // extern "C"
