#include "server/store/redis_store.h"

#include <atomic>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/runtime/random_name.h"
#include "server/runtime/refusals.h"
#include "server/store/redis_connection.h"
#include "server/store/redis_figures.h"
#include "server/store/redis_scripts.h"

namespace lpdeform {
namespace {

using namespace redis_scripts;
using Command = RedisConnection::Command;

ChangeOutcome outcome_of(std::int64_t answer) {
  if (answer == kIsBehind) return ChangeOutcome::kBehind;
  if (answer == kHasLostIt) return ChangeOutcome::kLost;
  return answer == kDone ? ChangeOutcome::kKept : ChangeOutcome::kFenced;
}

Command script(const std::string& text, const std::string& session) {
  return {"EVAL", text, "1", kSession + session};
}

std::string request_key(const std::string& owner, const std::string& request_id) {
  return absl::StrCat("lpdeform:r:", blob_key(absl::StrCat(owner.size(), ":", owner, request_id)));
}

class RedisStore final : public Store {
 public:
  explicit RedisStore(const RedisStoreOptions& options)
      : options_(options),
        writer_(options.host, options.port, options.patience, options.login),
        reader_(options.host, options.port, options.patience, options.login),
        toucher_(options.host, options.port, options.patience, options.login),
        presence_(options.host, options.port, options.patience, options.login),
        teller_(options.host, options.port, options.patience, options.login) {}

  /// Called once, before any other function.
  absl::Status begin() {
    const std::scoped_lock lock(touching_);
    holder_ = kShown + holder_;
    const absl::Status shown = show();
    if (is_away(shown)) return shown;
    is_shown_ = shown.ok();
    if (!is_shown_)
      holder_ = random_hex_128();  // this user may not SUBSCRIBE, so others wait for the lease to end
    const auto ran = toucher_.run({"HGET", "lpdeform:time", "ran"});
    if (!ran.ok()) return ran.status();
    if (!ran->is_nothing && !absl::SimpleAtoi(ran->text, &ran_))
      return store_failing("the key lpdeform:time in Redis was not written by lpdeform");
    told_ = ran_;
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) override;
  absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                          const std::string& route) override;
  absl::StatusOr<std::string> find_request(const std::string& owner, const std::string& request_id) override;
  absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                std::size_t most) override;
  absl::Status keep_blob(const std::string& session, const std::string& key, std::string_view bytes) override;
  absl::StatusOr<std::string> blob(const std::string& key) override;
  absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) override;
  std::chrono::milliseconds touch_every() const override { return options_.lease / 3; }
  absl::Status release(const std::vector<HeldSession>& sessions) override;
  absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) override;
  absl::StatusOr<std::optional<StoreFigures>> figures() override {
    const auto info = teller_.run({"INFO"});
    if (!info.ok()) return info.status();
    return redis_figures(info->text);
  }
  void end_by(std::chrono::steady_clock::time_point end) override {
    for (RedisConnection* const connection : {&writer_, &reader_, &toucher_, &presence_, &teller_})
      connection->end_by(end);
  }

 private:
  Command command_of(const StoredChange& change);
  std::string lease() const { return absl::StrCat(options_.lease.count()); }
  std::string most_gone() const { return absl::StrCat(options_.most_gone); }
  std::string told() const { return absl::StrCat(told_.load()); }
  /// Shows the holder's presence; may be called again. Fails if the connection is gone.
  absl::Status show() { return presence_.run({"SUBSCRIBE", kPresence + holder_}).status(); }

  const RedisStoreOptions options_;
  std::string holder_ = random_hex_128();  // constant after begin()
  bool is_shown_ = false;                  // constant after begin()
  /// ran_: `ran` in Redis at the last touch. told_: `ran` at the last touch whose answers have all been
  /// handled.
  std::int64_t ran_ = 0;
  std::atomic<std::int64_t> told_{0};
  std::mutex writing_, reading_, touching_;
  // The toucher has a connection of its own, so that leases are renewed while a large mesh is being sent.
  // Presence needs one because it is subscribed. The last connection asks for figures: a user without
  // permission for that loses the connection.
  RedisConnection writer_, reader_, toucher_, presence_, teller_;
};

Command RedisStore::command_of(const StoredChange& change) {
  if (change.is_removal) {
    Command command = script(kRemove, change.session);
    command.insert(command.end(),
                   {holder_, change.is_expiry ? "1" : "0", absl::StrCat(change.epoch_before), most_gone()});
    return command;
  }
  Command command = script(kCommit, change.session);
  command.insert(command.end(),
                 {holder_, absl::StrCat(change.epoch_before), absl::StrCat(change.epoch), lease(),
                  change.is_recreated ? "2" : (change.replaces_all ? "1" : "0"),
                  absl::StrCat(change.revision_before), absl::StrCat(change.revision), told()});
  if (change.epoch_before == 0 || change.is_recreated) {
    const std::string request = change.request_id.empty() ? "" : request_key(change.owner, change.request_id);
    command.insert(
        command.end(),
        {"owner", absl::StrCat("=", change.owner), "route", absl::StrCat("=", change.route), "blobs",
         absl::StrCat("=", absl::StrJoin(change.blobs, " ")), "request", absl::StrCat("=", request)});
  }
  for (const auto& [name, value] : change.parts) {
    command.push_back(kPart + name);
    command.push_back(value ? absl::StrCat("=", *value) : std::string("-"));
  }
  return command;
}

absl::StatusOr<std::vector<ChangeOutcome>> RedisStore::commit(std::span<const StoredChange> changes) {
  std::vector<Command> commands;
  for (const StoredChange& change : changes) commands.push_back(command_of(change));
  const std::scoped_lock lock(writing_);
  const auto replies = writer_.run(commands);
  if (!replies.ok()) return replies.status();
  std::vector<ChangeOutcome> outcomes;
  for (const RedisReply& reply : *replies) outcomes.push_back(outcome_of(reply.number));
  return outcomes;
}

absl::StatusOr<StoredSession> RedisStore::take_over(const std::string& session, const std::string& owner,
                                                    const std::string& route) {
  Command command = script(kTakeOver, session);
  command.insert(command.end(), {holder_, owner, lease(), route, absl::StrCat(options_.stays.count()),
                                 absl::StrCat(kEpochsOfALife)});
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run(command);
  if (!reply.ok()) return reply.status();
  if (reply->elements.empty()) return session_unknown();
  if (reply->elements[0].number == kIsHeld) return held_elsewhere(reply->elements[1].text);
  StoredSession found;
  found.owner = owner;
  for (std::size_t k = 0; k + 1 < reply->elements.size(); k += 2) {
    const std::string& field = reply->elements[k].text;
    const std::string& value = reply->elements[k + 1].text;
    if (field == "route") found.route = value;
    if (field == "epoch" && !absl::SimpleAtoi(value, &found.epoch)) return session_damaged("it has no epoch");
    if (field.starts_with(kPart)) found.parts[field.substr(kPart.size())] = value;
  }
  return found;
}

absl::StatusOr<std::string> RedisStore::find_request(const std::string& owner,
                                                     const std::string& request_id) {
  if (request_id.empty()) return "";
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run({"GET", request_key(owner, request_id)});
  if (!reply.ok()) return reply.status();
  return reply->text;
}

absl::StatusOr<std::vector<std::string>> RedisStore::list(const std::string& owner, const std::string& after,
                                                          std::size_t most) {
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run({"EVAL", kList, "0", owner, kSession + after, absl::StrCat(most)});
  if (!reply.ok()) return reply.status();
  std::vector<std::string> names;
  for (const auto& key : reply->elements) names.push_back(key.text.substr(kSession.size()));
  return names;
}

absl::Status RedisStore::keep_blob(const std::string& session, const std::string& key,
                                   std::string_view bytes) {
  Command use = script(kUseBlob, session);
  use.push_back(key);
  const std::scoped_lock lock(reading_);
  const auto known = reader_.run(use);
  if (!known.ok() || known->number == 1) return known.status();
  return reader_.run({"SET", kBlob + key, std::string(bytes)}).status();
}

absl::StatusOr<std::string> RedisStore::blob(const std::string& key) {
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run({"GET", kBlob + key});
  if (!reply.ok()) return reply.status();
  if (!reply->is_nothing && blob_key(reply->text) == key) return reply->text;
  return session_damaged(reply->is_nothing ? "its mesh is missing" : "its mesh is not what was written",
                         kBlob + key);
}

absl::StatusOr<TouchResult> RedisStore::touch(std::span<const TouchedSession> sessions) {
  const std::scoped_lock lock(touching_);
  told_ = ran_;
  std::vector<Command> commands{{"EVAL", kTick, "0", lease()}};
  for (const TouchedSession& session : sessions) {
    commands.push_back(script(kTouch, session.name));
    commands.back().insert(commands.back().end(),
                           {holder_, absl::StrCat(session.epoch), lease(),
                            session.is_being_made ? "2" : (session.is_in_use ? "1" : "0"),
                            absl::StrCat(session.revision), told()});
  }
  if (is_shown_) {
    if (absl::Status status = show(); !status.ok()) return status;
  }
  const auto replies = toucher_.run(commands);
  if (!replies.ok()) return replies.status();
  ran_ = replies->front().number;
  TouchResult result;
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    const std::int64_t answer = (*replies)[k + 1].number;
    if (answer == kIsFenced) result.lost.push_back(sessions[k].name);
    if (answer == kIsBehind) result.behind.push_back(sessions[k].name);
    if (answer == kIsWanted) result.wanted.push_back(sessions[k].name);
    if (answer == kHasLostIt) result.missing.push_back(sessions[k].name);
  }
  return result;
}

absl::StatusOr<std::size_t> RedisStore::remove_unused(std::int64_t idle_ms) {
  constexpr std::int64_t kAtOnce = 100;  // limited, because other callers wait meanwhile
  const std::scoped_lock lock(touching_);
  for (std::size_t removed = 0;;) {
    const auto went =
        toucher_.run({"EVAL", kRemoveUnused, "0", absl::StrCat(idle_ms), absl::StrCat(kAtOnce), most_gone()});
    if (!went.ok()) return went.status();
    removed += static_cast<std::size_t>(went->number);
    if (went->number < kAtOnce) return removed;
  }
}

absl::Status RedisStore::release(const std::vector<HeldSession>& sessions) {
  std::vector<Command> commands;
  for (const HeldSession& session : sessions) {
    commands.push_back(script(kLetGo, session.name));
    commands.back().insert(commands.back().end(), {holder_, absl::StrCat(session.epoch)});
  }
  const std::scoped_lock lock(writing_);
  return writer_.run(commands).status();
}

}  // namespace

absl::StatusOr<std::shared_ptr<Store>> open_redis_store(const RedisStoreOptions& options) {
  auto store = std::make_shared<RedisStore>(options);
  if (absl::Status status = store->begin(); !status.ok()) return status;
  return store;
}

}  // namespace lpdeform
