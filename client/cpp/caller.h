#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cpp/upload.h"

namespace lpdeform::client {

/// Whether `text` is printable ASCII, as headers must be. gRPC aborts the process on any other header.
bool is_header_text(std::string_view text);

/// What every call sends about its caller.
struct Caller {
  std::function<std::string()> token;
  std::string route = new_request_id();
};

/// The headers of a call, as name and value: its token and its route. A token that cannot be a header is left out; the
/// server then reports that there is none.
std::vector<std::pair<std::string, std::string>> headers_of(const Caller& caller);

}  // namespace lpdeform::client
