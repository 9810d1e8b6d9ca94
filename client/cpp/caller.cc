#include "client/cpp/caller.h"

#include <algorithm>

namespace lpdeform::client {

bool is_header_text(std::string_view text) {
  return std::ranges::all_of(text, [](char letter) { return letter >= 0x20 && letter <= 0x7e; });
}

std::vector<std::pair<std::string, std::string>> headers_of(const Caller& caller) {
  std::vector<std::pair<std::string, std::string>> headers{{"lpdeform-session", caller.route}};
  const std::string token = caller.token ? caller.token() : "";
  if (!token.empty() && is_header_text(token)) headers.emplace_back("authorization", "Bearer " + token);
  return headers;
}

}  // namespace lpdeform::client
