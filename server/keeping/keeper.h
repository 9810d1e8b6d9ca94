#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "absl/status/statusor.h"
#include "server/keeping/store_calls.h"
#include "server/keeping/stored_state.h"
#include "server/runtime/log.h"
#include "server/runtime/metrics.h"
#include "server/runtime/task_pool.h"
#include "server/runtime/timers.h"
#include "server/session/session.h"
#include "server/store/store.h"

namespace lpdeform {

/// Keeps sessions in a store while they live. No caller waits for the store. One thread writes the latest
/// changes of all sessions at once; updates coalesce, so the queue has at most one entry per session. A
/// second thread reads, and writes blobs. A third tells the store which sessions this process has.
///
/// While the store fails or is slower than kPatience, updates are answered as accepted but not kept, and new
/// sessions are refused. Everything else goes on, and the changes are written as soon as the store works
/// again. The same holds for a full store, but only for changes that it has no room for: they are retried now
/// and then, while removals and changes that need no more room are written at once. If the store does not
/// answer, callers that need an answer are refused at once. The keeper knows this after one caller has waited
/// without an answer, or after a call of the store has been under way for too long (StoreCalls). Thread-safe. Held by a
/// shared pointer.
class Keeper : public std::enable_shared_from_this<Keeper> {
 public:
  struct Services {
    std::shared_ptr<Timers> timers;
    std::shared_ptr<Metrics> metrics;
    std::shared_ptr<const Log> log;
    Timers::Duration idle;  // after this time without use sessions are removed
  };

  static std::shared_ptr<Keeper> create(std::shared_ptr<Store> store, Services services);
  /// Writes the remaining changes, if that is possible before the deadline that flush() was given.
  ~Keeper();

  using OnDone = std::function<void(absl::Status)>;
  using OnKept = std::function<void(bool is_kept)>;

  /// Called, on a thread of the keeper, with a session that another server has taken over or wants. Set it
  /// before any other call.
  std::function<void(const Session&)> on_lost;

  /// Adds a new session. `on_done`: OK once the session is stored. Otherwise UNAVAILABLE STORE_FAILING or
  /// RESOURCE_EXHAUSTED STORE_FULL, and nothing of it is stored.
  void add(std::shared_ptr<Session> session, StoredHead head, const std::string& request_id, OnDone on_done);

  /// Adds a session that was restored from the result of take_over().
  void adopt(std::shared_ptr<Session> session, const StoredSession& stored);

  /// The session's inputs have reached `revision`, in `epoch`. `on_kept` is called once: with true when they
  /// are stored, with false if that takes too long.
  void changed(const Session& session, std::uint64_t revision, std::uint64_t epoch, OnKept on_kept);

  /// Removes the session from the store, too, whoever holds it. take_over() does not find it any more.
  void remove(const std::string& name, OnDone on_done = nullptr);

  /// Removes a session that has not been used here for too long, unless another process holds it meanwhile.
  void expire(const Session& session);

  /// Whether the store refused the last change, or failed the last time it was asked. Then nothing should be
  /// begun that must be stored before it is answered. A full store does not count as failing.
  bool is_failing() const;
  /// OK if a change of the session can be stored as far as is known. Otherwise STORE_FAILING, or STORE_FULL
  /// if the store has refused a change of this session.
  absl::Status may_keep(const Session& session) const;

  /// Whether the session was removed here and the store may not know it yet.
  bool is_being_removed(const std::string& name) const;

  /// Releases the session: it leaves this process and stays in the store.
  void release(const Session& session);

  /// Takes a session over: the result of Store::take_over, with the session's blobs. If another process has
  /// the session in use, or if it is just leaving this one, the call waits for up to kPatienceForOthers,
  /// which is as long as the lease of a server that was cut off. It does not wait if the caller should use
  /// another route. The session is held until adopt() or give_up().
  struct Found {
    StoredSession session;
    StoredBlobs blobs;
  };
  using OnFound = std::function<void(absl::StatusOr<Found>)>;
  /// A caller, and the route by which it came.
  struct Asker {
    std::string owner, route;
  };
  void take_over(const std::string& name, const Asker& asker, OnFound on_found);

  /// The session from take_over() is not restored after all: another process may have it.
  void give_up(const std::string& name);

  using OnName = std::function<void(absl::StatusOr<std::string>)>;
  void find_request(const std::string& owner, const std::string& request_id, OnName on_name);

  /// Names of the owner's sessions that only the store has, in order and after `after`: those for which
  /// `is_wanted` is true, at most `most`.
  using OnNames = std::function<void(absl::StatusOr<std::vector<std::string>>)>;
  void list(const std::string& owner, const std::string& after, std::size_t most,
            std::function<bool(const std::string&)> is_wanted, OnNames on_names);

  /// A session of which the store lacks something when the process ends.
  struct Unkept {
    std::string name;
    std::uint64_t updates = 0;                  // how many are missing
    std::uint64_t input_seq = 0, kept_seq = 0;  // the newest update, and the newest that is stored
    bool is_removal = false;                    // the session was deleted, and will come back
  };

  /// Waits, before the process ends, until everything is stored, and retries while the store fails, until
  /// `end`. After `end` no change is begun to be written, and no store call is awaited; one that is under way
  /// may still succeed. Callers who wait for it, or come later, are told STORE_FAILING, or that their update is
  /// not kept. Returns what is not stored. The log has a line for each such session.
  std::vector<Unkept> flush(std::chrono::steady_clock::time_point end);

  /// A session counts as in use for this long after its last use, and as long as it has a stream, because the
  /// user may pause in a drag.
  static constexpr std::chrono::milliseconds kInUse{1000};
  static constexpr std::chrono::milliseconds kPatience{250};
  static constexpr std::chrono::milliseconds kPatienceForNew{10'000};
  static constexpr std::chrono::milliseconds kPatienceForOthers{2'000};

 private:
  Keeper(std::shared_ptr<Store> store, Services services);
  using Clock = std::chrono::steady_clock;
  /// Calls to make after the lock is released.
  struct Calls {
    std::vector<std::function<void()>> all;
    std::vector<HeldSession> to_release;  // released in the store with one round trip

    void add(std::function<void()> call) { all.push_back(std::move(call)); }
  };

  struct Waiting {
    std::uint64_t revision = 0, epoch = 0;
    Timers::TimePoint until;
    Clock::time_point since;
    OnKept on_kept;
  };
  struct Entry {
    std::shared_ptr<Session> session;  // null: the session is being removed
    std::string head;                  // its part "head"
    std::vector<std::string> blobs;
    std::string request_id;
    std::uint64_t revision = 0, epoch = 0;  // what is stored
    std::uint64_t input_seq = 0;            // what is stored
    std::vector<Waiting> waiting;
    OnDone on_added;  // set until the session is first stored
    std::vector<OnDone> on_removed;
    bool is_leaving = false;  // removed from the entries once it is stored
    bool is_expired = false;  // for a removal: see StoredChange::is_expiry
    bool is_lost = false;     // lost by the store, and must be written again
    bool is_refused = false;  // refused by the store, which has no room for it
  };
  /// What one entry must write to the store.
  struct Work {
    std::string name;
    std::shared_ptr<Session> session;  // null: a removal
    std::string head;
    std::uint64_t revision = 0;  // the stored revision before; later the one after `change`
    StoredChange change;
    std::uint64_t input_seq = 0;                    // of the change
    absl::Status status = {};                       // why the change cannot be written
    std::map<std::string, std::string> blobs = {};  // for a lost session that is written again
  };

  static constexpr char kEnds[] = "the server ends";

  void run();
  std::vector<Work> take_work(bool is_retry);
  static void fill_in(Work& work);
  static void refill(Work& work);
  void write(std::vector<Work> works, bool is_all);
  absl::Status check_end() const;
  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const Work> works);
  static std::size_t bytes_of(std::span<const Work> works);
  void write_all(Entry& entry, const std::string& name);
  void rewrite(Entry& entry, const std::string& name);
  void note_kept(const Work& work, ChangeOutcome outcome, Calls& calls);
  void note_failed(const Work& work, const absl::Status& why, Calls& calls);
  void note_written(const absl::Status& status, bool is_all);
  void note_full(const absl::Status& status);
  bool is_last() const { return is_stopping_ || is_over_; }
  bool is_pausing() const { return is_writing_failing_ || is_full_; }
  std::vector<Unkept> unkept() const;
  static std::optional<Unkept> unkept_of(const std::string& name, const Entry& entry);
  void tell_of(const std::vector<Unkept>& unkept) const;
  void note_read(const absl::Status& status, Clock::time_point begin);
  void note_health(const absl::Status& status);
  void try_again_later();
  void note_slow(std::size_t updates);
  absl::Status check_store_answers(Clock::time_point since) const;
  absl::Status keep_blob(Clock::time_point since, const std::string& name, const std::string& key,
                         const std::string& bytes);
  template <typename Ask>
  std::invoke_result_t<Ask> ask(Clock::time_point since, const Ask& what, std::size_t bytes = 0);
  void answer_kept(Entry& entry, Calls& calls);
  static void answer_all(Entry& entry, Calls& calls);
  void answer_failed(Entry& entry, const absl::Status& why, Calls& calls);
  void answer_everybody(Calls& calls);
  void note_waited(const Waiting& one);
  void make(const Calls& calls);
  void due(const std::string& name);
  void watch(const std::string& name, Timers::TimePoint when);
  void give_up_waiting(const std::string& name);
  void enter_new(const std::string& name, Entry entry);
  void give_up_new(const std::string& name);
  void take_over_until(const std::string& name, const Asker& asker, Timers::TimePoint end,
                       const OnFound& on_found);
  absl::StatusOr<Found> find(const std::string& name, const Asker& asker, Clock::time_point since);
  absl::StatusOr<Found> read(const std::string& name, const Asker& asker, Clock::time_point since);
  bool is_leaving(const std::string& name) const;
  void watch_unused();
  void sweep();
  void touch_all();
  void show_figures(Timers::TimePoint now);
  void watch_room();
  void watch_calls();
  void look_at_calls();
  template <typename Answer>
  std::function<void(Answer)> answered_once(std::function<void(Answer)> on_answer);
  void show_room();
  using Sessions = std::map<std::string, std::shared_ptr<Session>>;
  Entry* same_entry(const std::string& name, const Sessions& touched);
  void drop(const std::vector<std::string>& lost, const Sessions& touched);
  void write_again(const TouchResult& result, const Sessions& touched);
  void hand_over(const std::vector<std::string>& names, const Sessions& touched);

  const std::shared_ptr<Store> store_;
  const Services services_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Entry> entries_;
  std::map<std::string, std::uint64_t> being_made_;  // epochs of sessions from take_over()
  std::set<std::string> due_;
  bool is_writing_ = false;
  bool is_writing_failing_ = false, is_reading_failing_ = false;
  bool is_full_ = false;      // the store has no room for a change that is due
  bool was_full_ = false;     // as last reported to the log and the metrics
  bool has_fresh_ = false;    // a change is due that the store has not refused
  bool is_ending_ = false;    // flush() waits
  bool is_over_ = false;      // flush() waits no longer
  bool was_failing_ = false;  // as last reported to the log and the metrics
  bool is_trying_again_ = false;
  bool is_hanging_ = false;  // the last call of the store took long and failed
  bool is_stuck_ = false;    // a call has been under way for too long
  StoreCalls calls_;
  WaitingCallers callers_;
  Clock::time_point next_word_;  // when the log may next say that the store is slow
  Clock::time_point retry_at_;
  Clock::duration pause_{};
  bool is_stopping_ = false;
  Timers::TimePoint next_sweep_;
  Timers::TimePoint next_figures_;  // used by the toucher's thread only
  TaskPool reader_, toucher_;
  std::thread writer_;
};

}  // namespace lpdeform
