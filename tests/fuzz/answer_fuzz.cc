// libFuzzer: how a client reads the answer to a gRPC-Web call. The input is the body; its first byte is the size of the pieces in which
// the body comes. Messages and status must not depend on it.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cpp/grpc_web/grpc_web.h"
#include "core/base/check.h"

namespace {

struct Read {
  std::vector<std::string> messages;
  absl::Status ended, status;

  bool operator==(const Read&) const = default;
};

Read read(std::string_view body, std::size_t piece) {
  lpdeform::client::AnswerReader reader;
  Read out;
  out.ended = reader.header(":status", "200");
  out.ended.Update(reader.header("content-type", "application/grpc-web+proto"));
  for (; !body.empty() && out.ended.ok(); body.remove_prefix(std::min(piece, body.size())))
    out.ended = reader.bytes(body.substr(0, piece),
                             [&](std::string message) { out.messages.push_back(std::move(message)); });
  out.status = reader.status();
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view body(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Read whole = read(body, std::max<std::size_t>(body.size(), 1));
  for (const std::string& message : whole.messages)
    LPDEFORM_CHECK(message.size() <= lpdeform::client::AnswerReader::kMostMessageBytes);
  LPDEFORM_CHECK(read(body, std::max<std::size_t>(data[0], 1)) == whole);
  return 0;
}
