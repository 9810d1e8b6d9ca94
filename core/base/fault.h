#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform {

/// core/base/reasons.h declares them all.
enum class Reason;

/// What an error is about, in a form for programs.
struct NewFault {
  Reason reason;
  /// The first offending element: "vertex 17", "face 3", "handle \"tip\"", "component 2", "p[5]". May be
  /// empty.
  std::string element;
  /// The bound that was broken: "vertices < 370", "1 <= p <= 64". May be empty.
  std::string limit;
};

/// An error for the caller, with the code of its reason. `text` is one plain sentence that names the value and the limit.
absl::Status make_fault(NewFault fault, std::string_view text);

/// The same with another code than the usual one: proto/reasons.toml says of which reasons (`other_code`).
absl::Status make_fault(absl::StatusCode code, NewFault fault, std::string_view text);

/// A number for a fault's text, to as many digits as tell it from its neighbours: six where these read back to it.
std::string exact(double number);

/// A fault as clients receive it: it travels inside an absl::Status and reaches them unchanged. A newer server may send
/// a reason that this version does not know.
struct Fault {
  /// Stable, upper case, never reworded: "MESH_NOT_FINITE", "HANDLE_VERTEX_TWICE".
  std::string reason;
  std::string element;
  std::string limit;

  bool operator==(const Fault&) const = default;
};

/// The fault inside `status`; all fields are empty if it carries none.
Fault fault_of(const absl::Status& status);

/// fault.reason == Reason::kSessionUnknown
bool operator==(std::string_view said, Reason reason);

/// An error with a fault that was made before: told to us by another, or said again with another text.
absl::Status carry_fault(absl::StatusCode code, const Fault& fault, std::string_view text);

}  // namespace lpdeform
