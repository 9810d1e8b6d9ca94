#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/mesh/weld.h"
#include "server/runtime/timers.h"
#include "server/session/history.h"
#include "server/session/update.h"

namespace lpdeform {

/// The handles and settings in force: an immutable value.
struct Inputs {
  std::uint64_t version = 0;    // rises with every update that is accepted
  std::uint64_t input_seq = 0;  // of the newest update included
  std::uint64_t taken = 0;      // how many input_seqs have been the newest so far
  std::shared_ptr<const HandleSet> handles;
  std::shared_ptr<const Material> material;
  SolveSettings solver;
  // The same values in the client's vertices, as the client gave them; the same objects if nothing is welded.
  std::shared_ptr<const HandleSet> given_handles;
  std::shared_ptr<const Material> given_material;
};

/// The input_seq of the newest value of each part. Removed handles are remembered so that a late update does
/// not bring them back. The oldest of these tombstones are dropped first. After that, an update of an
/// unknown handle counts as stale if its input_seq is not above that of a dropped one.
struct InputAges {
  std::map<std::string, std::uint64_t, std::less<>> handles;
  std::uint64_t forgotten = 0;  // the newest age that was dropped
  std::uint64_t p = 0, stiffness = 0, length_unit = 0, solver = 0, region = 0;
};

/// What a mailbox holds, and which parts have changed since a given revision.
struct InputChanges {
  std::uint64_t revision = 0;  // the present revision
  Inputs inputs;
  InputAges ages;
  bool is_all = false;                 // treat everything as changed
  std::vector<std::string> regrouped;  // handles set, ascending
  std::vector<std::string> moved;      // handles with a new target, those set included
  std::vector<std::string> removed;
  bool has_p = false, has_stiffness = false, has_region = false;
  HandleHistory::Extent history;
  HandleHistory::Changes steps;           // of the history
  bool is_undo = false, is_redo = false;  // what the newest input is
};

/// History of a session that is restored: its steps for undo and redo.
struct InputHistory {
  std::uint64_t first = 0;
  std::size_t undo_steps = 0;
  std::vector<std::vector<HandleChange>> steps;
  bool is_undo = false, is_redo = false;  // what the newest input is
};

/// Limits on the handles of one session.
struct InputLimits {
  static constexpr std::size_t kMostHandles = 4096, kMostUndo = 100;  // the defaults
  std::size_t handles = kMostHandles;
  std::size_t undo_steps = kMostUndo;
};

/// Where updates meet the solver. It keeps the newest value, by input_seq, of each handle and each setting.
/// Each of these is decided separately, so a late update of one does not undo another. An update is checked
/// against the state that it would lead to, and is accepted as a whole or not at all. Updates coalesce
/// instead of queueing: the solver reads the newest values when it has time. Thread-safe.
class Mailbox {
 public:
  /// `weld`: from the vertices of updates to those of `shape`; null if they are the same. `timers`: used to
  /// detect pauses between gestures; if null, none are detected.
  explicit Mailbox(std::shared_ptr<const RestShape> shape, std::shared_ptr<const Weld> weld = nullptr,
                   InputLimits limits = {}, std::shared_ptr<Timers> timers = nullptr);

  /// Takes an update. A part whose input_seq equals that of the present value is a repetition: it is dropped,
  /// but does not count as stale. Errors, INVALID_ARGUMENT: INPUT_SEQ_ZERO, HANDLE_CHANGED_TWICE (in this
  /// update), TOO_MANY_HANDLES, HANDLE_TARGET_TOO_FAR, COPIES_DIFFER, and those of check_settings,
  /// check_method_takes, check_equations, check_material and HandleSet; NOT_FOUND HANDLE_UNKNOWN. A component
  /// without a handle is no error here: handles may come one by one.
  absl::StatusOr<UpdateResult> take(const Update& update);

  /// Sets what a session begins with, as an update that is older than all others.
  absl::Status begin_with(const Update& update);

  /// The same for a session that is restored: its whole state, and the ages of its parts. More errors:
  /// INPUT_SEQ_TOO_HIGH, and TOO_MANY_HANDLES if more handles are remembered than there can be.
  absl::Status begin_again(const Update& state, InputAges ages, InputHistory history = {});

  /// Undoes the newest step of the handles (see HandleHistory), or redoes the step that was undone last, as
  /// an update with this input_seq. The input_seq must be higher than all before: ABORTED INPUT_SEQ_PASSED.
  /// It is idempotent: a repetition of the last call gives the same answer. FAILED_PRECONDITION
  /// NOTHING_TO_UNDO, NOTHING_TO_REDO; otherwise as take().
  absl::StatusOr<UndoResult> undo(std::uint64_t input_seq, bool redo);

  /// How many steps can be undone and redone, and how many bytes the history takes.
  struct HistorySize {
    std::size_t undo_steps = 0, redo_steps = 0, bytes = 0;
  };
  HistorySize history_size() const;

  Inputs newest() const;
  /// newest().version
  std::uint64_t version() const;

  /// Rises with each update that changes something.
  std::uint64_t revision() const;
  /// What has changed since `revision`; everything if that is 0.
  InputChanges changes_since(std::uint64_t revision) const;

 private:
  /// The revision at which each part last changed.
  struct Revisions {
    struct OfHandle {
      std::uint64_t set = 0, moved = 0, removed = 0;
    };
    std::uint64_t newest = 1;  // before anything has changed
    std::map<std::string, OfHandle, std::less<>> handles;
    std::uint64_t all = 0, p = 0, stiffness = 0, region = 0;
  };
  struct Candidate;

  enum class Origin { kBeginning, kWriter, kHistory };
  absl::StatusOr<UpdateResult> merge(const Update& update, Origin origin);
  bool replaces(std::uint64_t age, const Update& update, Candidate& next) const;
  bool replaces_handle(const std::string& name, const Update& update, Candidate& next) const;
  absl::Status change_handles(const Update& update, Candidate& next) const;
  void change_settings(const Update& update, Candidate& next) const;
  absl::Status check(const Candidate& next, const Inputs& before) const;
  absl::Status weld(Candidate& next) const;
  absl::Status check_welded(const Candidate& next) const;
  std::int32_t vertex_count() const { return weld_ ? weld_->split_count() : shape_->vertex_count(); }

  void note_ages(const Candidate& next, std::uint64_t seq);
  void note_revisions(const Candidate& next);
  void note_step(const Update& update, const Candidate& next, const Inputs& before);
  void forget_oldest();
  void remember_undo(bool redo);
  void put_in_force(const Update& update, Candidate& next);

  const std::shared_ptr<const RestShape> shape_;
  const std::shared_ptr<const Weld> weld_;
  const InputLimits limits_;
  const std::shared_ptr<Timers> timers_;
  mutable std::mutex merging_;  // one update at a time; guards what follows
  InputAges ages_;
  Revisions revisions_;
  HandleHistory history_;
  struct LastUndo {
    std::uint64_t input_seq = 0;
    bool redo = false;
    UndoResult result;
  };
  std::optional<LastUndo> last_undo_;
  mutable std::mutex mutex_;  // guards inputs_; held only briefly
  Inputs inputs_;
};

}  // namespace lpdeform
