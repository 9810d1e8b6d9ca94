#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform {

/// What an error is about, in a form for programs. It travels inside an absl::Status and reaches clients unchanged.
struct Fault {
  /// Stable, upper case, never reworded: "MESH_NOT_FINITE", "HANDLE_VERTEX_TWICE".
  std::string reason;
  /// The first offending element: "vertex 17", "face 3", "handle \"tip\"", "component 2", "p[5]". May be
  /// empty.
  std::string element;
  /// The bound that was broken: "vertices < 370", "1 <= p <= 64". May be empty.
  std::string limit;

  bool operator==(const Fault&) const = default;
};

/// An error for the caller. `text` is one plain sentence that names the value and the limit.
absl::Status make_fault(absl::StatusCode code, Fault fault, std::string_view text);

/// The same with code INVALID_ARGUMENT, the usual one.
absl::Status invalid_input(Fault fault, std::string_view text);

/// The fault inside `status`; all fields are empty if it carries none.
Fault fault_of(const absl::Status& status);

}  // namespace lpdeform
