#include "server/open_calls.h"

#include <grpcpp/server_context.h>

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

/// A call, as long as it is under way.
struct OpenCall {
  std::mutex mutex;
  grpc::ServerContextBase* context = nullptr;  // null when it has ended

  void cancel() {
    const std::scoped_lock lock(mutex);
    if (context != nullptr) context->TryCancel();
  }
  void forget() {
    const std::scoped_lock lock(mutex);
    context = nullptr;
  }
};

class Watcher final : public Interceptor {
 public:
  explicit Watcher(std::shared_ptr<OpenCall> call) : call_(std::move(call)) {}
  ~Watcher() override { call_->forget(); }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_CLOSE)) call_->forget();
    methods->Proceed();
  }

 private:
  const std::shared_ptr<OpenCall> call_;
};

class WatcherFactory final : public ServerInterceptorFactoryInterface {
 public:
  WatcherFactory(const std::shared_ptr<Timers>& timers, Timers::Duration after)
      : timers_(timers), after_(after) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* info) override {
    if (!std::string_view(info->method()).starts_with("/grpc.")) return nullptr;
    const auto timers = timers_.lock();
    if (!timers) return nullptr;
    const auto call = std::make_shared<OpenCall>();
    call->context = info->server_context();
    timers->at(timers->now() + after_, [weak = std::weak_ptr(call)] {
      if (const auto open = weak.lock()) open->cancel();
    });
    return new Watcher(call);
  }

 private:
  const std::weak_ptr<Timers> timers_;
  const Timers::Duration after_;
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> end_open_calls(const std::shared_ptr<Timers>& timers,
                                                                  Timers::Duration after) {
  return std::make_unique<WatcherFactory>(timers, after);
}

}  // namespace lpdeform
