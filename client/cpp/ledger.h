#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "client/cpp/types.h"

namespace lpdeform::client {

/// Puts `newer` on top of `older`: the newest value of each handle and each setting wins; a motion for a
/// handle that `older` adds moves the added one.
void merge(Update& older, Update newer);

/// An update and its number, which the server knows as input_seq.
struct NumberedUpdate {
  std::uint64_t seq = 0;
  Update update;
};

/// The writer's book of updates: what the server has accepted (all that is needed to make the session anew),
/// what is on its way (at most kWindow), and what waits (merged into one). Bounded by the size of the handles
/// and settings themselves. Not thread-safe.
class Ledger {
 public:
  static constexpr std::size_t kWindow = 4;
  /// Handles of which it is remembered that they were let go of; of more than that, none.
  static constexpr std::size_t kMostRemovals = 8192;

  /// `begins_bare`: a session made anew has no handles but those of this book, otherwise also those that it is made with.
  explicit Ledger(bool begins_bare = true) : begins_bare_(begins_bare) {}

  /// Takes an update on; returns its number.
  std::uint64_t add(Update update);

  bool can_send() const { return (restore_ || waiting_) && in_flight_.size() < kWindow; }
  bool has_waiting() const { return restore_ || waiting_; }
  /// What send_next() gives is the state that a lost session had.
  bool has_restore() const { return restore_.has_value(); }
  bool has_in_flight() const { return !in_flight_.empty(); }

  /// What is to be sent next, now on its way. Needs has_waiting().
  NumberedUpdate send_next();

  /// The server has taken the update of this number, or refused it. Unknown numbers are nothing to us. `is_kept`: it, and
  /// all taken before it, survive the end of the server.
  void accept(std::uint64_t seq, bool is_kept = false);
  void refuse(std::uint64_t seq);
  /// A frame shows the update of this number. If it is of the present epoch, the update is ours, so the server has taken it,
  /// though its answer may still be on its way. Earlier updates without an answer may have been refused: then nothing changes
  /// until they are answered.
  void show(std::uint64_t epoch, std::uint64_t seq);

  /// A number for a change that the server makes by itself, and the change that it made.
  std::uint64_t take_number() { return next_seq_++; }
  void accept_change(NumberedUpdate change, bool is_kept);

  /// The session goes on, and the newest update that it has is `seq`: what it took after that and did not keep is to be sent
  /// first, on its own.
  void resumed_at(std::uint64_t seq);
  /// The same of a session that is at `epoch`. In a newer one than before another server has it, and its newest update says
  /// nothing of those before that: a call may have brought it there. So all that was not kept is sent; of what the server has
  /// that changes nothing.
  void reopened(std::uint64_t epoch, std::uint64_t seq);
  /// Of a session just made, joined or taken over.
  void begin_epoch(std::uint64_t epoch) { epoch_ = epoch; }

  /// The connection is gone: what was on its way waits again. Sending it twice does no harm, it is the same
  /// value.
  void connection_lost();
  /// The server has lost the session: what it had accepted is to be sent first, on its own.
  void session_lost();
  /// Another writer took over: what it has not taken is void, and so is what it took and may have lost.
  void drop_unaccepted();

  /// Numbers that follow are higher than `seq`, the newest that the server knows.
  void count_from(std::uint64_t seq);

  std::uint64_t newest_accepted() const { return accepted_.seq; }

  /// The newest update that was not refused; 0 where there is none.
  std::uint64_t newest() const;

 private:
  void merge_accepted(NumberedUpdate update, bool is_kept);

  const bool begins_bare_;
  std::uint64_t next_seq_ = 1;
  std::uint64_t epoch_ = 0;
  NumberedUpdate accepted_;  // where it begins bare, handles only as Handle, never as Motion or Removal
  NumberedUpdate unkept_;    // what was accepted since the server last kept something, as it came
  std::optional<NumberedUpdate> restore_;
  std::deque<NumberedUpdate> in_flight_;
  std::optional<NumberedUpdate> waiting_;
};

}  // namespace lpdeform::client
