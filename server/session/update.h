#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/geometry.h"
#include "core/problem/handles.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// Lets go of a handle.
struct Removal {};

/// A change of one handle: adds or replaces it, moves it, or lets go of it.
struct HandleChange {
  std::string name;
  std::variant<Handle, HandleMotion, Removal> change;
};

/// What is left out keeps its value.
struct SettingsChange {
  std::optional<Field> p;
  std::optional<Field> stiffness;
  std::optional<double> length_unit;
  std::optional<SolveSettings> solver;
  /// Vertices of the region of interest; none: everything may move.
  std::optional<std::vector<std::int32_t>> region;
};

/// A change of handles and settings, as a writer sends it.
struct Update {
  std::uint64_t input_seq = 0;
  std::vector<HandleChange> handles;
  SettingsChange settings;
  bool begins_step = false;  // of the history of handles
};

/// How an update was taken.
struct UpdateResult {
  std::uint64_t input_seq = 0;
  std::uint32_t stale_parts = 0;
  std::uint64_t revision = 0;  // of the session's inputs, from which on the update is in them
  bool is_kept = false;        // it is in the server's store
};

/// How a step was taken back, or done again.
struct UndoResult {
  UpdateResult update;
  std::vector<HandleChange> changes;           // that were made
  std::size_t undo_steps = 0, redo_steps = 0;  // that there are now
};

}  // namespace lpdeform
