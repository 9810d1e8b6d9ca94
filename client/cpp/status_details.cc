#include "client/cpp/status_details.h"

#include <google/protobuf/unknown_field_set.h>

#include <functional>

#include "absl/strings/match.h"
#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;

// Field numbers of google/rpc/status.proto, google/rpc/error_details.proto and google/protobuf/any.proto.
// They never change, and reading them by number spares every user of this library Google's common protos.
constexpr int kStatusDetails = 3;
constexpr int kAnyTypeUrl = 1, kAnyValue = 2;
constexpr int kErrorInfoReason = 1, kErrorInfoMetadata = 3;
constexpr int kEntryKey = 1, kEntryValue = 2;

/// Calls `visit` for each length-delimited field of a serialised message. Reads nothing where it is not one.
void for_each_field(const std::string& message,
                    const std::function<void(int number, const std::string& bytes)>& visit) {
  UnknownFieldSet fields;
  if (!fields.ParseFromString(message)) return;
  for (int k = 0; k < fields.field_count(); ++k) {
    const UnknownField& field = fields.field(k);
    if (field.type() == UnknownField::TYPE_LENGTH_DELIMITED) visit(field.number(), field.length_delimited());
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

Fault fault_in(const std::string& details) {
  Fault fault;
  for_each_field(details, [&](int number, const std::string& any) {
    if (number != kStatusDetails) return;
    std::string type;
    std::string value;
    for_each_field(any, [&](int part, const std::string& bytes) {
      if (part == kAnyTypeUrl) type = bytes;
      if (part == kAnyValue) value = bytes;
    });
    if (absl::EndsWith(type, "/google.rpc.ErrorInfo")) read_error_info(value, fault);
  });
  return fault;
}

}  // namespace

absl::Status with_details(absl::StatusCode code, std::string_view text, const std::string& details) {
  const Fault fault = fault_in(details);
  return fault == Fault{} ? absl::Status(code, std::string(text)) : make_fault(code, fault, text);
}

}  // namespace lpdeform::client
