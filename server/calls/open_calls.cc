#include "server/calls/open_calls.h"

#include <grpcpp/server_context.h>

#include <map>
#include <mutex>
#include <string_view>
#include <utility>

namespace lpdeform {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

/// The calls under way. Thread-safe.
class OpenCalls {
 public:
  void add(const Interceptor* of, grpc::ServerContextBase* context, Timers::TimePoint now) {
    const std::scoped_lock lock(mutex_);
    calls_[of] = {context, now};
  }
  void forget(const Interceptor* of) {
    const std::scoped_lock lock(mutex_);
    calls_.erase(of);
  }
  /// Cancels the calls that began by then. gRPC reports their ends on threads of its own.
  void cancel_begun_by(Timers::TimePoint then) {
    const std::scoped_lock lock(mutex_);
    for (const auto& [of, call] : calls_) {
      if (call.began <= then) call.context->TryCancel();
    }
  }

 private:
  struct Call {
    grpc::ServerContextBase* context = nullptr;
    Timers::TimePoint began;
  };
  std::mutex mutex_;
  std::map<const Interceptor*, Call> calls_;
};

class Watcher final : public Interceptor {
 public:
  explicit Watcher(std::shared_ptr<OpenCalls> calls) : calls_(std::move(calls)) {}
  ~Watcher() override { calls_->forget(this); }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_CLOSE)) calls_->forget(this);
    methods->Proceed();
  }

 private:
  const std::shared_ptr<OpenCalls> calls_;
};

/// Checks the calls four times within the limit of their duration.
void look_later(const std::weak_ptr<Timers>& weak_timers, const std::weak_ptr<OpenCalls>& weak_calls,
                Timers::Duration after) {
  const auto timers = weak_timers.lock();
  if (!timers) return;
  timers->at(timers->now() + after / 4, [weak_timers, weak_calls, after] {
    const auto calls = weak_calls.lock();
    const auto alive = weak_timers.lock();
    if (!calls || !alive) return;
    calls->cancel_begun_by(alive->now() - after);
    look_later(weak_timers, weak_calls, after);
  });
}

class WatcherFactory final : public ServerInterceptorFactoryInterface {
 public:
  WatcherFactory(const std::shared_ptr<Timers>& timers, Timers::Duration after) : timers_(timers) {
    look_later(timers_, calls_, after);
  }

  Interceptor* CreateServerInterceptor(ServerRpcInfo* info) override {
    const bool is_open = std::string_view(info->method()).starts_with("/grpc.");
    if (!is_open || info->type() == ServerRpcInfo::Type::UNARY) return nullptr;
    const auto timers = timers_.lock();
    if (!timers) return nullptr;
    auto* const watcher = new Watcher(calls_);
    calls_->add(watcher, info->server_context(), timers->now());
    return watcher;
  }

 private:
  const std::weak_ptr<Timers> timers_;
  const std::shared_ptr<OpenCalls> calls_ = std::make_shared<OpenCalls>();
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> end_open_calls(const std::shared_ptr<Timers>& timers,
                                                                  Timers::Duration after) {
  return std::make_unique<WatcherFactory>(timers, after);
}

}  // namespace lpdeform
