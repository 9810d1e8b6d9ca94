// Keeper: the end of the process, and what the store has not stored by then.

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "server/keeping/keeper.h"

namespace lpdeform {

std::vector<Keeper::Unkept> Keeper::flush(Clock::time_point end) {
  store_->end_by(end);
  std::vector<Unkept> left;
  Calls calls;
  bool is_cut_off = false;
  {
    std::unique_lock lock(mutex_);
    is_ending_ = true;
    retry_at_ = Clock::now();  // the store may work again
    changed_.notify_all();
    is_over_ = !changed_.wait_until(lock, end, [this] { return due_.empty() && !is_writing_; });
    is_cut_off = is_over_;
    if (is_over_) left = unkept();
    if (is_over_) answer_everybody(calls);
  }
  changed_.notify_all();
  tell_of(left);
  make(calls);
  if (is_cut_off) callers_.refuse_all(store_failing(kEnds));
  return left;
}

/// Called with the lock held. A hanging store may answer one day, but then nobody would tell its callers.
void Keeper::answer_everybody(Calls& calls) {
  for (auto& [name, entry] : entries_) answer_failed(entry, store_failing(kEnds), calls);
}

/// Called with the lock held. In the order of the names.
std::vector<Keeper::Unkept> Keeper::unkept() const {
  std::vector<Unkept> all;
  for (const auto& [name, entry] : entries_) {
    if (auto one = unkept_of(name, entry)) all.push_back(*std::move(one));
  }
  return all;
}

/// nullopt if the store has everything, if no client was told that it has more, or if the state will correct
/// itself: an unused session will be removed the next time, too.
std::optional<Keeper::Unkept> Keeper::unkept_of(const std::string& name, const Entry& entry) {
  if (entry.session == nullptr) {
    const bool is_known = entry.epoch != 0 && !entry.is_expired;
    return is_known ? std::optional(Unkept{.name = name, .is_removal = true}) : std::nullopt;
  }
  if (entry.on_added) return std::nullopt;
  const SessionChanges changes = entry.session->changes_since(entry.revision);
  const std::uint64_t revision = changes.inputs.revision;
  if (revision <= entry.revision && changes.lease.epoch <= entry.epoch && !entry.is_lost) return std::nullopt;
  return Unkept{name, revision - std::min(revision, entry.revision), changes.lease.input_seq,
                entry.input_seq};
}

void Keeper::tell_of(const std::vector<Unkept>& unkept) const {
  std::uint64_t updates = 0;
  for (const Unkept& one : unkept) {
    updates += one.updates;
    const std::string text =
        one.is_removal ? "It was deleted, and the store still has it."
                       : "The store has not taken its last updates; its client may send them again.";
    services_.log->error_each("session_not_kept", {{"session", abbreviated(one.name)},
                                                   {"updates", where_known(one.updates)},
                                                   {"kept_input_seq", one.kept_seq},
                                                   {"input_seq", where_known(one.input_seq)},
                                                   {"text", text}});
  }
  if (!unkept.empty())
    services_.log->error("not_kept", {{"sessions", std::uint64_t{unkept.size()}},
                                      {"updates", updates},
                                      {"text", "The server ends, and the store lacks this data."}});
}

}  // namespace lpdeform
