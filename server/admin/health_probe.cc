#include "server/admin/health_probe.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <httplib.h>

#include <chrono>
#include <future>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace lpdeform {
namespace {

/// grpc.health.v1.HealthCheckResponse with status SERVING: field 1 is the varint 1. Written by hand because
/// Debian's gRPC does not include the generated message.
constexpr char kServing[] = {0x08, 0x01};

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  for (const grpc::Slice& slice : slices)
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

bool admin_says_so(const std::string& url) {
  httplib::Client client(url);
  const auto answer = client.Get("/healthz");
  return answer && answer->status == 200;
}

}  // namespace

bool is_serving(const std::string& address, const std::string& service) {
  if (absl::StartsWith(address, "http://")) return admin_says_so(address);
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(3));
  // HealthCheckRequest: field 1 is the name, of less than 128 bytes.
  const std::string name =
      service.empty() ? "" : absl::StrCat("\x0a", std::string(1, static_cast<char>(service.size())), service);
  const grpc::Slice message(name);
  const grpc::ByteBuffer request(&message, 1);
  grpc::ByteBuffer response;
  std::promise<grpc::Status> ended;
  stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", {}, &request, &response,
                 [&ended](grpc::Status status) { ended.set_value(std::move(status)); });
  return ended.get_future().get().ok() && bytes_of(response) == std::string(kServing, sizeof(kServing));
}

}  // namespace lpdeform
