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

/// Removes a handle.
struct Removal {};

/// A change of one handle: sets it (adds or replaces), moves it, or removes it.
struct HandleChange {
  std::string name;
  std::variant<Handle, HandleMotion, Removal> change;
};

/// Settings that are absent keep their values.
struct SettingsChange {
  std::optional<Field> p;
  std::optional<Field> stiffness;
  std::optional<double> length_unit;
  std::optional<SolveSettings> solver;
  /// Vertices of the region of interest; an empty list: everything may move.
  std::optional<std::vector<std::int32_t>> region;
};

/// A change of handles and settings, as a writer sends it.
struct Update {
  std::uint64_t input_seq = 0;
  std::vector<HandleChange> handles;
  SettingsChange settings;
  bool begins_step = false;  // a new step of the history of handles begins
};

/// The result of an update.
struct UpdateResult {
  std::uint64_t input_seq = 0;
  std::uint32_t stale_parts = 0;
  std::uint64_t revision = 0;  // of the session's inputs, once the update is in them
  bool is_kept = false;        // whether the server's store has it
};

/// The result of an undo or a redo.
struct UndoResult {
  UpdateResult update;
  std::vector<HandleChange> changes;           // the changes that were made
  std::size_t undo_steps = 0, redo_steps = 0;  // after the undo or redo
};

}  // namespace lpdeform
