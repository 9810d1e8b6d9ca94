#include "client/cpp/grpc_web/grpc_web.h"

#include <charconv>
#include <cstdint>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cpp/status_details.h"

namespace lpdeform::client {
namespace {

constexpr std::size_t kPrefixBytes = 5;
constexpr std::uint8_t kCompressed = 0x01;
constexpr std::uint8_t kTrailers = 0x80;
constexpr int kMostCode = 16;  // UNAUTHENTICATED

std::uint32_t length_in(std::string_view prefix) {
  std::uint32_t length = 0;
  for (std::size_t k = 1; k < kPrefixBytes; ++k) length = length << 8 | static_cast<std::uint8_t>(prefix[k]);
  return length;
}

/// Replaces each %XX by its byte; leaves other text as it is.
std::string percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const bool is_escape = text[k] == '%' && k + 2 < text.size() && absl::ascii_isxdigit(text[k + 1]) &&
                           absl::ascii_isxdigit(text[k + 2]);
    if (!is_escape) {
      out += text[k];
      continue;
    }
    unsigned char byte = 0;
    std::from_chars(text.data() + k + 1, text.data() + k + 3, byte, 16);
    out += static_cast<char>(byte);
    k += 2;
  }
  return out;
}

absl::Status too_long(std::string_view what, std::size_t size, std::size_t most) {
  return absl::ResourceExhaustedError(
      absl::StrCat(std::string(what), " of ", size, " bytes came; the limit is ", most, "."));
}

absl::Status after_the_trailers() {
  return absl::InternalError("Something came after the trailers.");
}

/// As gRPC prescribes for answers that do not come from gRPC.
absl::StatusCode code_of_http(std::string_view status) {
  if (status == "400") return absl::StatusCode::kInternal;
  if (status == "401") return absl::StatusCode::kUnauthenticated;
  if (status == "403") return absl::StatusCode::kPermissionDenied;
  if (status == "404") return absl::StatusCode::kUnimplemented;
  const bool is_passing = status == "429" || status == "502" || status == "503" || status == "504";
  return is_passing ? absl::StatusCode::kUnavailable : absl::StatusCode::kUnknown;
}

}  // namespace

std::string framed(std::string_view message) {
  std::string out(1, '\0');
  const auto size = static_cast<std::uint32_t>(message.size());
  for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(size >> shift & 0xff);
  return out.append(message);
}

absl::Status AnswerReader::header(std::string_view name, std::string_view value) {
  header_bytes_ += name.size() + value.size();
  if (header_bytes_ > kMostHeaderBytes) return too_long("Headers", header_bytes_, kMostHeaderBytes);
  if (name == ":status") fields_.clear();  // after an interim answer
  fields_.insert_or_assign(std::string(name), std::string(value));
  return absl::OkStatus();
}

absl::Status AnswerReader::bytes(std::string_view bytes, const std::function<void(std::string)>& take) {
  if (!is_grpc_web()) {  // a page about an error, for people
    page_bytes_ += bytes.size();
    return page_bytes_ <= kMostMessageBytes ? absl::OkStatus()
                                            : too_long("A page", page_bytes_, kMostMessageBytes);
  }
  waiting_.append(bytes);
  if (has_trailers_ && !bytes.empty()) return after_the_trailers();
  std::string_view left = waiting_;
  while (left.size() >= kPrefixBytes) {
    const auto kind = static_cast<std::uint8_t>(left[0]);
    const std::size_t size = length_in(left);
    if ((kind & kCompressed) != 0) return absl::UnimplementedError("A compressed message came.");
    const bool is_end = (kind & kTrailers) != 0;
    if (is_end && size > kMostHeaderBytes) return too_long("Trailers", size, kMostHeaderBytes);
    if (size > kMostMessageBytes) return too_long("A message", size, kMostMessageBytes);
    if (left.size() < kPrefixBytes + size) break;
    const std::string_view content = left.substr(kPrefixBytes, size);
    left.remove_prefix(kPrefixBytes + size);
    if (!is_end) {
      take(std::string(content));
      continue;
    }
    read_trailers(content);
    has_trailers_ = true;
    if (!left.empty()) return after_the_trailers();
  }
  waiting_.erase(0, waiting_.size() - left.size());
  return absl::OkStatus();
}

void AnswerReader::read_trailers(std::string_view block) {
  for (const absl::string_view line : absl::StrSplit(absl::string_view(block.data(), block.size()), "\r\n")) {
    const std::size_t colon = line.find(':');
    if (colon == line.npos) continue;
    const std::string name = absl::AsciiStrToLower(line.substr(0, colon));
    if (!absl::StartsWith(name, "grpc-"))
      continue;  // the rest of the answer is of the type that its headers said
    fields_.insert_or_assign(name, std::string(absl::StripAsciiWhitespace(line.substr(colon + 1))));
  }
}

bool AnswerReader::is_grpc_web() const {
  const auto type = fields_.find("content-type");
  return type != fields_.end() && absl::StartsWith(type->second, "application/grpc");
}

absl::Status AnswerReader::status() const {
  const auto field = [this](std::string_view name) {
    const auto found = fields_.find(name);
    return found == fields_.end() ? std::string() : found->second;
  };
  int code = 0;
  if (absl::SimpleAtoi(field("grpc-status"), &code)) {
    if (code == 0) return absl::OkStatus();
    std::string details;
    (void)absl::Base64Unescape(field("grpc-status-details-bin"), &details);
    const auto known = static_cast<absl::StatusCode>(code < 0 || code > kMostCode ? 2 : code);
    return with_details(known, percent_decoded(field("grpc-message")), details);
  }
  const std::string http = field(":status");
  if (http == "200" && is_grpc_web()) return absl::UnavailableError("The answer ended too early.");
  if (http == "200") return absl::UnimplementedError("What answers there does not speak gRPC-Web.");
  return {code_of_http(http), absl::StrCat("HTTP status ", http, ".")};
}

}  // namespace lpdeform::client
