#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "client/cpp/types.h"

namespace lpdeform::client {

/// In which order the updates that are in flight reach the server.
enum class Order {
  kWritten,  // as they were sent
  kAny,      // they may overtake each other
};

/// Merges `newer` into `older`: the newest value of each handle and each setting wins. If `older` adds a handle and
/// `newer` moves it, the added handle gets the motion.
void merge(Update& older, Update newer);

/// An update and its number, which the server knows as input_seq.
struct NumberedUpdate {
  std::uint64_t seq = 0;
  Update update;
};

/// Merges `other` into `one`, whichever came first; of equal numbers, `one` is the older.
void join(NumberedUpdate& one, NumberedUpdate other);

/// The writer's record of updates: accepted ones (merged; all that is needed to create the session again), those in
/// flight (at most kWindow), and those that wait (merged into one). Its size is bounded by that of the handles and
/// settings themselves. Not thread-safe.
class Ledger {
 public:
  static constexpr std::size_t kWindow = 4;
  /// The same if updates may overtake each other on their way. Then there are several only if all of them merely move
  /// handles: such updates may come in any order, since each handle keeps its newest value.
  static constexpr std::size_t kUnorderedWindow = 2;
  /// The most removed handles that are remembered. If there are more, all are forgotten.
  static constexpr std::size_t kMostRemovals = 8192;

  /// `begins_bare`: a session that is created again has only the handles of this ledger. Otherwise it also has the
  /// handles that it is created with.
  explicit Ledger(bool begins_bare = true, Order order = Order::kWritten)
      : begins_bare_(begins_bare), order_(order) {}

  /// Adds an update; returns its number.
  std::uint64_t add(Update update);

  bool can_send() const;
  bool has_waiting() const { return restore_ || waiting_; }
  /// Whether send_next() returns the state of a lost session.
  bool has_restore() const { return restore_.has_value(); }
  bool has_in_flight() const { return !in_flight_.empty(); }

  /// The next update to send; it then counts as in flight. Requires has_waiting().
  NumberedUpdate send_next();

  /// The server has accepted, or refused, the update with this number. Unknown numbers are ignored. `is_kept`: this
  /// update and all accepted before it survive the end of the server.
  void accept(std::uint64_t seq, bool is_kept = false);
  void refuse(std::uint64_t seq);
  /// A frame shows the update of this number. If it is of the present epoch, the update is ours, so the server has taken it,
  /// though its answer may still be on its way. Earlier updates without an answer may have been refused: then nothing changes
  /// until they are answered. A restore has the number of an update that was accepted before: no frame shows that it came.
  void show(std::uint64_t epoch, std::uint64_t seq);

  /// For a change that the server makes itself (undo): its number, and later the change.
  std::uint64_t take_number() { return next_seq_++; }
  void accept_change(NumberedUpdate change, bool is_kept);

  /// The session continues, and its newest update is `seq`. Updates that it accepted after that but did not keep are
  /// sent again first, as an update of their own.
  void resumed_at(std::uint64_t seq);
  /// The same for a session in `epoch`. If the epoch has risen, another server has loaded the session. Its newest
  /// update then says nothing about earlier ones, because a call may have brought it there. So all updates that were
  /// not kept are sent again; those that the server has change nothing.
  void reopened(std::uint64_t epoch, std::uint64_t seq);
  /// The epoch of a session that was just created, joined or taken over.
  void begin_epoch(std::uint64_t epoch) {
    epoch_ = epoch;
    newest_dropped_ = 0;
  }

  /// The connection is lost: updates in flight wait again. Updates are idempotent, so sending one twice does no harm.
  void connection_lost();
  /// The server has lost the session: all accepted updates are sent again first, as an update of their own.
  void session_lost();
  /// Another writer took over: updates that the server has not accepted are void, and so are updates that it accepted
  /// but may have lost.
  void drop_unaccepted();

  /// Makes all following numbers higher than `seq`, the newest that the server knows.
  void count_from(std::uint64_t seq);

  std::uint64_t newest_accepted() const { return accepted_.seq; }

  /// The newest update that was not refused; 0 if there is none.
  std::uint64_t newest() const;
  /// What newest() was before the last drop_unaccepted() of this epoch; 0 if there was none. Results of earlier updates answer
  /// none that was dropped.
  std::uint64_t newest_dropped() const { return newest_dropped_; }

 private:
  void merge_accepted(NumberedUpdate update, bool is_kept);

  const bool begins_bare_;
  const Order order_;
  std::uint64_t next_seq_ = 1;
  std::uint64_t epoch_ = 0;
  std::uint64_t newest_dropped_ = 0;
  NumberedUpdate accepted_;  // if begins_bare_, handles only as Handle, never as Motion or Removal
  NumberedUpdate unkept_;    // accepted since the server last kept an update; changes as they were sent
  std::optional<NumberedUpdate> restore_;  // what the server may have lost, with what it has accepted since
  std::deque<NumberedUpdate> in_flight_;
  std::map<std::uint64_t, NumberedUpdate>
      restores_;  // in flight, by number; what to send if they are sent again
  std::optional<NumberedUpdate> waiting_;
};

}  // namespace lpdeform::client
