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

/// Keeps sessions in a store while they live. Nobody who calls it waits for the store: one thread writes whatever has
/// changed since it last did, of all sessions at once, however many updates that were; so the queue is at most one entry a
/// session. Another thread reads, and writes blobs; a third tells the store which sessions are here.
///
/// While the store fails or is slower than kPatience, updates are answered as taken and not kept, new sessions are refused
/// and the rest goes on; what has changed is kept as soon as the store works again. Of one that is full the same holds for what it has no
/// room for, and for that alone: it is tried again now and then, and what goes or needs no more room is written at once. Where it does not answer, whoever needs an answer is
/// refused at once: the first has waited for it, or everybody until a call of it has been under way for too long (StoreCalls). Thread-safe. Held by a shared pointer.
class Keeper : public std::enable_shared_from_this<Keeper> {
 public:
  struct Services {
    std::shared_ptr<Timers> timers;
    std::shared_ptr<Metrics> metrics;
    std::shared_ptr<const Log> log;
    Timers::Duration idle;  // after which sessions that nobody uses go
  };

  static std::shared_ptr<Keeper> create(std::shared_ptr<Store> store, Services services);
  /// Writes what is left, if it can be written before the moment that flush() was given.
  ~Keeper();

  using OnDone = std::function<void(absl::Status)>;
  using OnKept = std::function<void(bool is_kept)>;

  /// Called, on a thread of the keeper's, with a session that another server has taken over, or wants. To be set before anything
  /// else is called.
  std::function<void(const Session&)> on_lost;

  /// A new session. `on_done`: OK once it is kept; else UNAVAILABLE STORE_FAILING or RESOURCE_EXHAUSTED STORE_FULL, and it is not kept
  /// at all.
  void add(std::shared_ptr<Session> session, StoredHead head, const std::string& request_id, OnDone on_done);

  /// A session made again from what take_over() gave.
  void adopt(std::shared_ptr<Session> session, const StoredSession& stored);

  /// The session's inputs have come to `revision`, in `epoch`. `on_kept` is called once: true when they are kept, false
  /// where that takes too long.
  void changed(const Session& session, std::uint64_t revision, std::uint64_t epoch, OnKept on_kept);

  /// The session goes from the store, too, whoever has it. From now on take_over() does not find it.
  void remove(const std::string& name, OnDone on_done = nullptr);

  /// Nobody has used it here for so long that it goes; not from the store where somebody else has it meanwhile.
  void expire(const Session& session);

  /// The store did not take the last change, or did not give what it was last asked for: what has to be kept before it is answered
  /// is better not begun. One that is full does not fail.
  bool is_failing() const;
  /// OK where a change of the session may be kept as things are: else STORE_FAILING, or STORE_FULL where the store has refused one of it.
  absl::Status may_keep(const Session& session) const;

  /// Whether the session was removed and the store may not know yet.
  bool is_being_removed(const std::string& name) const;

  /// The session leaves this process and stays in the store.
  void release(const Session& session);

  /// What Store::take_over finds, with its blobs. Where another process has the session in use, waits for kPatienceForOthers
  /// whether it lets go: as long as the lease of one that was cut off; the same while it leaves this one. Not where the asker should
  /// come by another way. What was found is held until adopt() or give_up().
  struct Found {
    StoredSession session;
    StoredBlobs blobs;
  };
  using OnFound = std::function<void(absl::StatusOr<Found>)>;
  /// Who asks, and the way by which they came.
  struct Asker {
    std::string owner, route;
  };
  void take_over(const std::string& name, const Asker& asker, OnFound on_found);

  /// What take_over() found is not made again after all: another may have it.
  void give_up(const std::string& name);

  using OnName = std::function<void(absl::StatusOr<std::string>)>;
  void find_request(const std::string& owner, const std::string& request_id, OnName on_name);

  /// Names of the owner's sessions that only the store has, by name after `after`: as far as `is_wanted`, at most `most`.
  using OnNames = std::function<void(absl::StatusOr<std::vector<std::string>>)>;
  void list(const std::string& owner, const std::string& after, std::size_t most,
            std::function<bool(const std::string&)> is_wanted, OnNames on_names);

  /// What of a session the store has not taken when the process ends.
  struct Unkept {
    std::string name;
    std::uint64_t updates = 0;                  // how many
    std::uint64_t input_seq = 0, kept_seq = 0;  // the newest one, and the newest that is kept
    bool is_removal = false;                    // it was deleted, and comes back
  };

  /// Before the process ends: waits until all is kept, and tries again and again where the store fails, until this moment. After it the
  /// store is neither asked nor waited for any more, and whoever waits for it, or comes later, is told STORE_FAILING, or that an update is
  /// not kept. What is not kept, with a line in the log for each session.
  std::vector<Unkept> flush(std::chrono::steady_clock::time_point end);

  /// A session that was used so long ago is still in use, and so is one with a stream: a drag may rest.
  static constexpr std::chrono::milliseconds kInUse{1000};
  static constexpr std::chrono::milliseconds kPatience{250};
  static constexpr std::chrono::milliseconds kPatienceForNew{10'000};
  static constexpr std::chrono::milliseconds kPatienceForOthers{2'000};

 private:
  Keeper(std::shared_ptr<Store> store, Services services);
  using Clock = std::chrono::steady_clock;
  /// To be done without the lock.
  struct Calls {
    std::vector<std::function<void()>> all;
    std::vector<HeldSession> to_let_go;  // by the store, in one journey

    void add(std::function<void()> call) { all.push_back(std::move(call)); }
  };

  struct Waiting {
    std::uint64_t revision = 0, epoch = 0;
    Timers::TimePoint until;
    Clock::time_point since;
    OnKept on_kept;
  };
  struct Entry {
    std::shared_ptr<Session> session;  // null: it goes
    std::string head;                  // its part of that name
    std::vector<std::string> blobs;
    std::string request_id;
    std::uint64_t revision = 0, epoch = 0;  // kept
    std::uint64_t input_seq = 0;            // the same
    std::vector<Waiting> waiting;
    OnDone on_added;  // until it is kept for the first time
    std::vector<OnDone> on_removed;
    bool is_leaving = false;  // forgotten once it is kept
    bool is_expired = false;  // of one that goes: see StoredChange
    bool is_lost = false;     // by the store, and to be written anew
    bool is_refused = false;  // by the store, which has no room for it
  };
  /// What one entry has for the store.
  struct Work {
    std::string name;
    std::shared_ptr<Session> session;  // null: a removal
    std::string head;
    std::uint64_t revision = 0;  // kept so far, then: once `change` is
    StoredChange change;
    std::uint64_t input_seq = 0;                    // of it
    absl::Status status = {};                       // why it cannot be written
    std::map<std::string, std::string> blobs = {};  // where it is written anew
  };

  static constexpr char kEnds[] = "the server ends";

  void run();
  std::vector<Work> take_work(bool is_retry);
  static void fill_in(Work& work);
  static void fill_in_anew(Work& work);
  void write(std::vector<Work> works, bool is_all);
  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const Work> works);
  static std::size_t bytes_of(std::span<const Work> works);
  void write_all(Entry& entry, const std::string& name);
  void write_anew(Entry& entry, const std::string& name);
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
  absl::Status asked_in_vain(Clock::time_point since) const;
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
  std::map<std::string, std::uint64_t> being_made_;  // epochs of those that take_over() found
  std::set<std::string> due_;
  bool is_writing_ = false;
  bool is_writing_failing_ = false, is_reading_failing_ = false;
  bool is_full_ = false;      // it has no room for something that is due
  bool was_full_ = false;     // as the log and the metrics know it
  bool has_fresh_ = false;    // something is due that it has not refused
  bool is_ending_ = false;    // flush() waits
  bool is_over_ = false;      // it has waited for long enough
  bool was_failing_ = false;  // as the log and the metrics know it
  bool is_trying_again_ = false;
  bool is_hanging_ = false;  // what it was last asked for took long, and came to nothing
  bool is_stuck_ = false;    // a call has been under way for too long
  StoreCalls calls_;
  WaitingCallers callers_;
  Clock::time_point next_word_;  // of its being slow
  Clock::time_point retry_at_;
  Clock::duration pause_{};
  bool is_stopping_ = false;
  Timers::TimePoint next_sweep_;
  Timers::TimePoint next_figures_;  // the toucher's thread alone
  TaskPool reader_, toucher_;
  std::thread writer_;
};

}  // namespace lpdeform
