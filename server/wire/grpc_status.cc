#include "server/wire/grpc_status.h"

#include <string>
#include <string_view>
#include <utility>

#include "core/base/fault.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

constexpr char kDomain[] = "lpdeform";

void add_detail(const google::protobuf::Message& detail, google::rpc::Status& out) {
  static_cast<void>(out.add_details()->PackFrom(detail));  // fails from 2 GiB on
}

std::string reason_of(const absl::Status& status, const Fault& fault) {
  return fault.reason.empty() ? absl::StatusCodeToString(status.code()) : fault.reason;
}

void add_error_info(const absl::Status& status, const Fault& fault, google::rpc::Status& out) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason_of(status, fault));
  info.set_domain(kDomain);
  if (!fault.element.empty()) (*info.mutable_metadata())["element"] = fault.element;
  if (!fault.limit.empty()) (*info.mutable_metadata())["limit"] = fault.limit;
  add_detail(info, out);
}

void add_bad_request(const absl::Status& status, const Fault& fault, google::rpc::Status& out) {
  google::rpc::BadRequest bad;
  auto& violation = *bad.add_field_violations();
  violation.set_field(fault.element);
  violation.set_description(std::string(status.message()));
  add_detail(bad, out);
}

void add_quota_failure(const absl::Status& status, const Fault& fault, google::rpc::Status& out) {
  google::rpc::QuotaFailure quota;
  auto& violation = *quota.add_violations();
  violation.set_subject(fault.element);
  violation.set_description(std::string(status.message()));
  add_detail(quota, out);
}

/// The type of the resource that was not found, by the beginning of the reason.
constexpr std::pair<std::string_view, const char*> kResourceTypes[] = {
    {"SESSION_", "lpdeform.v1.Session"},
    {"UPLOAD_", "lpdeform.v1.Upload"},
    {"STREAM_", "lpdeform.v1.Stream"},
    {"HANDLE_", "lpdeform.v1.Handle"},
};

std::string resource_type_of(const std::string& reason) {
  for (const auto& [beginning, type] : kResourceTypes) {
    if (reason.starts_with(beginning)) return type;
  }
  return kDomain;
}

void add_resource_info(const absl::Status& status, const Fault& fault, google::rpc::Status& out) {
  google::rpc::ResourceInfo resource;
  resource.set_resource_type(resource_type_of(fault.reason));
  resource.set_resource_name(fault.element);
  resource.set_description(std::string(status.message()));
  add_detail(resource, out);
}

void add_retry_info(std::uint32_t after_ms, google::rpc::Status& out) {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(after_ms / 1000);
  retry.mutable_retry_delay()->set_nanos(static_cast<int>(after_ms % 1000) * 1'000'000);
  add_detail(retry, out);
}

}  // namespace

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const Fault fault = fault_of(status);
  google::rpc::Status details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(std::string(status.message()));
  add_error_info(status, fault, details);
  if (absl::IsInvalidArgument(status)) add_bad_request(status, fault, details);
  if (absl::IsResourceExhausted(status)) add_quota_failure(status, fault, details);
  if (absl::IsNotFound(status)) add_resource_info(status, fault, details);
  if (const std::uint32_t after_ms = retry_after_ms(status); after_ms != 0) add_retry_info(after_ms, details);
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message()),
          details.SerializeAsString()};
}

}  // namespace lpdeform
