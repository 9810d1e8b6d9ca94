#include "client/cpp/status_details.h"

#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/cpp/client.h"
#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

using google::protobuf::io::CodedInputStream;

// Field numbers of google/rpc/status.proto, google/rpc/error_details.proto and google/protobuf/any.proto. They never
// change. Reading them by number means that users of this library do not need Google's common protos.
constexpr int kStatusDetails = 3;
constexpr int kAnyTypeUrl = 1, kAnyValue = 2;
constexpr int kErrorInfoReason = 1, kErrorInfoMetadata = 3;
constexpr int kEntryKey = 1, kEntryValue = 2;
constexpr int kRetryDelay = 1, kDurationSeconds = 1, kDurationNanos = 2;

constexpr char kRetryPayload[] = "lpdeform/retry_after_ms";
/// One day. Longer pauses are as good as for ever, and would overflow a clock.
constexpr std::uint64_t kMostSeconds = 24 * 60 * 60;

/// A field of a serialised message: a number, or bytes.
struct Field {
  int number = 0;
  std::optional<std::uint64_t> varint;
  std::string bytes;
};

/// Reads the rest of a field after its tag; false if it is malformed. Fields of a fixed size are skipped.
bool read_field(CodedInputStream& input, std::uint32_t tag, Field& field) {
  constexpr std::uint32_t kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5;
  std::uint64_t number = 0;
  std::uint32_t size = 0;
  field.number = static_cast<int>(tag >> 3);
  switch (tag & 7) {
    case kVarint:
      if (!input.ReadVarint64(&number)) return false;
      field.varint = number;
      return true;
    case kFixed64:
      return input.Skip(8);
    case kBytes:
      return input.ReadVarint32(&size) && input.ReadString(&field.bytes, static_cast<int>(size));
    case kFixed32:
      return input.Skip(4);
    default:
      return false;
  }
}

/// The fields of a serialised message; empty if `message` is malformed. By hand, because the lite library has no other
/// way to read fields by number.
std::vector<Field> fields_of(const std::string& message) {
  CodedInputStream input(reinterpret_cast<const std::uint8_t*>(message.data()),
                         static_cast<int>(message.size()));
  std::vector<Field> fields;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (!read_field(input, tag, fields.emplace_back())) return {};
  }
  if (!input.ConsumedEntireMessage()) return {};
  return fields;
}

/// Calls `visit` for each length-delimited field of a serialised message. Does nothing if `message` is malformed.
void for_each_field(const std::string& message,
                    const std::function<void(int number, const std::string& bytes)>& visit) {
  for (const Field& field : fields_of(message)) {
    if (!field.varint) visit(field.number, field.bytes);
  }
}

void read_metadata(const std::string& entry, Fault& fault) {
  std::string key;
  std::string value;
  for_each_field(entry, [&](int number, const std::string& bytes) {
    if (number == kEntryKey) key = bytes;
    if (number == kEntryValue) value = bytes;
  });
  if (key == "element") fault.element = value;
  if (key == "limit") fault.limit = value;
}

void read_error_info(const std::string& error_info, Fault& fault) {
  for_each_field(error_info, [&](int number, const std::string& bytes) {
    if (number == kErrorInfoReason) fault.reason = bytes;
    if (number == kErrorInfoMetadata) read_metadata(bytes, fault);
  });
}

std::chrono::milliseconds read_retry_info(const std::string& retry_info) {
  std::uint64_t milliseconds = 0;
  for_each_field(retry_info, [&](int number, const std::string& duration) {
    if (number != kRetryDelay) return;
    for (const Field& field : fields_of(duration)) {
      const auto value = static_cast<std::int64_t>(field.varint.value_or(0));
      if (value < 0) continue;
      const auto positive = static_cast<std::uint64_t>(value);
      if (field.number == kDurationSeconds) milliseconds += 1000 * std::min(positive, kMostSeconds);
      if (field.number == kDurationNanos)
        milliseconds += std::min<std::uint64_t>(positive, 999'999'999) / 1'000'000;
    }
  });
  return std::chrono::milliseconds(milliseconds);
}

struct Details {
  Fault fault;
  std::chrono::milliseconds retry_after{0};
};

Details read_details(const std::string& details) {
  Details out;
  for_each_field(details, [&](int number, const std::string& any) {
    if (number != kStatusDetails) return;
    std::string type;
    std::string value;
    for_each_field(any, [&](int part, const std::string& bytes) {
      if (part == kAnyTypeUrl) type = bytes;
      if (part == kAnyValue) value = bytes;
    });
    if (absl::EndsWith(type, "/google.rpc.ErrorInfo")) read_error_info(value, out.fault);
    if (absl::EndsWith(type, "/google.rpc.RetryInfo")) out.retry_after = read_retry_info(value);
  });
  return out;
}

}  // namespace

absl::Status with_details(absl::StatusCode code, std::string_view text, const std::string& details) {
  const auto [fault, pause] = read_details(details);
  return with_retry_after(
      fault == Fault{} ? absl::Status(code, std::string(text)) : carry_fault(code, fault, text), pause);
}

absl::Status with_retry_after(absl::Status status, std::chrono::milliseconds pause) {
  if (pause.count() > 0) status.SetPayload(kRetryPayload, absl::Cord(absl::StrCat(pause.count())));
  return status;
}

std::chrono::milliseconds retry_after(const absl::Status& status) {
  const auto said = status.GetPayload(kRetryPayload);
  std::int64_t milliseconds = 0;
  if (said) (void)absl::SimpleAtoi(std::string(*said), &milliseconds);
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace lpdeform::client
