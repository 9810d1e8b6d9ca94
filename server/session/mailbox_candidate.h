#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/session/mailbox.h"

namespace lpdeform {

// Declarations that the source files of Mailbox share.

/// The state that an update would lead to.
struct Mailbox::Candidate {
  bool is_beginning = false;
  std::shared_ptr<HandleSet> handles;  // a copy that may be changed; empty if the update has no handles
  Material material;
  SolveSettings solver;
  // For the solver; empty if they did not change.
  std::shared_ptr<const HandleSet> solver_handles;
  std::shared_ptr<const Material> solver_material;
  std::vector<std::string> named;  // handles that the update changes
  std::vector<std::string> moved;  // those of them that get a new target
  std::vector<std::string> regrouped, removed;
  bool is_regrouped = false;  // vertices of handles, or the region, changed
  bool has_p = false, has_stiffness = false, has_length_unit = false, has_solver = false, has_region = false;
  std::uint32_t stale_parts = 0;

  bool has_handles() const { return is_regrouped || !moved.empty(); }
  bool changes_something() const {
    return !named.empty() || has_p || has_stiffness || has_length_unit || has_solver || has_region;
  }
  bool has_material() const { return has_p || has_stiffness || has_length_unit; }
};

absl::Status too_many_handles(std::size_t handles, std::size_t most);

}  // namespace lpdeform
