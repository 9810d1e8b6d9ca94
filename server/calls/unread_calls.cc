#include "server/calls/unread_calls.h"

#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "lpdeform/v1/service.grpc.pb.h"
#include "server/wire/grpc_status.h"

namespace lpdeform {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerInterceptorFactoryInterface;
using grpc::experimental::ServerRpcInfo;

absl::Status message_unreadable() {
  return make_fault({Reason::kMessageUnreadable, "", ""},
                    "The message cannot be parsed; perhaps a string is not UTF-8.");
}

class Teller final : public Interceptor {
 public:
  Teller(Backend& backend, std::string method) : backend_(backend), method_(std::move(method)) {}

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const grpc::Status status = methods->GetSendStatus();
      // This status is gRPC's own, INTERNAL since later versions; those of this server have details.
      const bool is_of_unread = status.error_code() == grpc::StatusCode::UNIMPLEMENTED ||
                                status.error_code() == grpc::StatusCode::INTERNAL;
      if (is_of_unread && status.error_details().empty()) {
        const absl::Status why = message_unreadable();
        backend_.begin_record(method_, {})->ended(why);
        methods->ModifySendStatus(to_grpc(why));
      }
    }
    methods->Proceed();
  }

 private:
  Backend& backend_;
  const std::string method_;
};

class TellerFactory final : public ServerInterceptorFactoryInterface {
 public:
  explicit TellerFactory(Backend& backend) : backend_(backend) {}

  Interceptor* CreateServerInterceptor(ServerRpcInfo* info) override {
    const std::string_view method = info->method();
    const bool is_ours = method.starts_with(absl::StrCat("/", v1::DeformService::service_full_name(), "/"));
    if (!is_ours || info->type() != ServerRpcInfo::Type::UNARY) return nullptr;
    return new Teller(backend_, std::string(method.substr(1)));
  }

 private:
  Backend& backend_;
};

}  // namespace

std::unique_ptr<ServerInterceptorFactoryInterface> tell_of_unread_calls(Backend& backend) {
  return std::make_unique<TellerFactory>(backend);
}

}  // namespace lpdeform
