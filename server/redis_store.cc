#include "server/redis_store.h"

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/random_name.h"
#include "server/redis_connection.h"

namespace lpdeform {
namespace {

using Command = RedisConnection::Command;

const std::string kSession = "lpdeform:s:", kBlob = "lpdeform:b:", kUsers = "lpdeform:u:";
const std::string kPart = "p:";

// Of all scripts, KEYS[1] is the session's hash and ARGV[1] the holder.
const std::string kNow = "local t = redis.call('TIME'); local now = t[1] * 1000 + math.floor(t[2] / 1000); ";

/// A function: the session is one of its owner's, a sorted set that lives as long as the youngest of them. Each time two of it
/// are looked at, so that few are in it that have expired.
const std::string kEnter =
    "local function enter(owner, idle) "
    "  local all = 'lpdeform:o:' .. redis.sha1hex(owner or ''); "
    "  redis.call('ZADD', all, 0, KEYS[1]); redis.call('PEXPIRE', all, idle); "
    "  for _, key in ipairs(redis.call('ZRANDMEMBER', all, 2)) do "
    "    if redis.call('EXISTS', key) == 0 then redis.call('ZREM', all, key) end "
    "  end "
    "end ";

/// No keys. ARGV: owner, the key of the session before the first, how many. Those that have expired go from the set.
const std::string kList =
    "local all, from, most = 'lpdeform:o:' .. redis.sha1hex(ARGV[1]), '(' .. ARGV[2], tonumber(ARGV[3]); "
    "local found = {}; "
    "while #found < most do "
    "  local some = redis.call('ZRANGEBYLEX', all, from, '+', 'LIMIT', 0, 100); "
    "  if #some == 0 then break end "
    "  for _, key in ipairs(some) do "
    "    from = '(' .. key; "
    "    if redis.call('HGET', key, 'owner') ~= ARGV[1] then redis.call('ZREM', all, key) "
    "    elseif #found < most then table.insert(found, key) end "
    "  end "
    "end "
    "return found";

/// ARGV: holder, epoch before, epoch, lease, idle, replaces all, revision before, revision, then names and values of hash fields
/// in turn, "=" before a value that is set and "-" for one that goes. 1: done; 0: fenced; 2: behind, which it is not where
/// it has more than that (the answer to the change before was lost), nor where nothing was changed since it was taken over.
const std::string kCommit =
    kNow +
    "if ARGV[2] ~= '0' then "
    "  local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch', 'revision'); "
    "  if has[1] ~= ARGV[1] or (has[2] ~= ARGV[2] and has[2] ~= ARGV[3]) then return 0 end "
    "  if ARGV[6] ~= '1' and has[3] and tonumber(has[3]) < tonumber(ARGV[7]) then return 2 end "
    "end "
    "if ARGV[6] == '1' then "
    "  for _, field in ipairs(redis.call('HKEYS', KEYS[1])) do "
    "    if string.sub(field, 1, 2) == 'p:' then redis.call('HDEL', KEYS[1], field) end "
    "  end "
    "end "
    "redis.call('HSET', KEYS[1], 'holder', ARGV[1], 'epoch', ARGV[3], 'until', now + ARGV[4], 'alive', now + "
    "ARGV[4], 'revision', ARGV[8]); "
    "for k = 9, #ARGV, 2 do "
    "  if string.sub(ARGV[k + 1], 1, 1) == '=' then redis.call('HSET', KEYS[1], ARGV[k], string.sub(ARGV[k + "
    "1], 2)) "
    "  else redis.call('HDEL', KEYS[1], ARGV[k]) end "
    "end "
    "redis.call('PEXPIRE', KEYS[1], ARGV[5]); " +
    kEnter + "enter(redis.call('HGET', KEYS[1], 'owner'), ARGV[5]); return 1";

/// That somebody wants a session is remembered for so many milliseconds.
const std::string kWanted = "1000";

/// ARGV: holder, owner, lease, idle, route, stays. -1: none; -2 and its route: held by another, or for another; else the hash, in
/// the new epoch. `until`: it is in use; `alive`: its holder lives; `since`: it came; `stays`: for so long at least.
const std::string kTakeOver =
    kNow +
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'owner', 'route', 'wanter'); "
    "if not has[2] or has[2] ~= ARGV[2] then return -1 end "
    "local function number(field) return tonumber(redis.call('HGET', KEYS[1], field) or '0') end "
    "local route, stays = has[3] or '', math.max(number('stays'), tonumber(ARGV[6])); "
    "local is_wanted = now - number('wanted') < " +
    kWanted +
    "; "
    "if has[1] ~= ARGV[1] then "
    "  local is_astray = route ~= '' and ARGV[5] ~= '' and ARGV[5] ~= route; "
    "  if number('until') > now or (is_astray and number('alive') > now) then "
    "    if route ~= '' and route == ARGV[5] and now - number('since') > stays and "
    "      (not is_wanted or has[4] == ARGV[1]) then "
    "      redis.call('HSET', KEYS[1], 'wanted', now, 'wanter', ARGV[1]) "
    "    end "
    "    return {-2, route} "
    "  end "
    "end "
    "if is_wanted and has[4] ~= ARGV[1] then return {-2, route} end "
    "local is_back_soon = is_wanted and now - number('since') < 4 * stays; "
    "stays = is_back_soon and math.min(2 * stays, 32 * ARGV[6]) or tonumber(ARGV[6]); "
    "redis.call('HINCRBY', KEYS[1], 'epoch', 1); "
    "redis.call('HSET', KEYS[1], 'holder', ARGV[1], 'until', now + ARGV[3], 'alive', now + ARGV[3], 'since', "
    "now, "
    "'stays', stays); "
    "redis.call('HDEL', KEYS[1], 'revision', 'wanted', 'wanter'); "
    "redis.call('PEXPIRE', KEYS[1], ARGV[4]); return redis.call('HGETALL', KEYS[1])";

/// ARGV: holder, epoch, lease, 1 where it is in use and 2 where it is being made, idle, revision. 0: another has it, or it is
/// gone; 2: it is behind; 3: another wants it. Its blobs live as long.
const std::string kTouch =
    kNow +
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'blobs', 'request', 'owner', 'revision', 'wanted'); "
    "if has[1] ~= ARGV[1] then return 0 end " +
    kEnter +
    "enter(has[4], ARGV[5]); "
    "redis.call('HSET', KEYS[1], 'alive', now + ARGV[3]); "
    "if ARGV[4] ~= '0' then redis.call('HSET', KEYS[1], 'until', now + ARGV[3]) end "
    "if ARGV[4] == '2' then redis.call('HSET', KEYS[1], 'since', now) end "
    "redis.call('PEXPIRE', KEYS[1], ARGV[5]); "
    "for key in string.gmatch(has[2] or '', '%x+') do "
    "  redis.call('PEXPIRE', 'lpdeform:b:' .. key, ARGV[5]); redis.call('PEXPIRE', 'lpdeform:u:' .. key, "
    "ARGV[5]) "
    "end "
    "if has[3] and has[3] ~= '' then redis.call('PEXPIRE', has[3], ARGV[5]) end "
    "if has[5] and tonumber(has[5]) < tonumber(ARGV[6]) then return 2 end "
    "if has[6] and now - tonumber(has[6]) < " +
    kWanted + " then return 3 end return 1";

/// ARGV: holder, session, 1 where it goes only if the holder has it, then the keys of its blobs, as far as its maker knows. 0: it
/// has it no more.
const std::string kRemove =
    "local holder = redis.call('HGET', KEYS[1], 'holder'); "
    "if ARGV[3] == '1' and holder and holder ~= ARGV[1] then return 0 end "
    "local function let_go(key) "
    "  redis.call('SREM', 'lpdeform:u:' .. key, ARGV[2]); "
    "  if redis.call('SCARD', 'lpdeform:u:' .. key) == 0 then redis.call('DEL', 'lpdeform:b:' .. key) end "
    "end "
    "local has = redis.call('HMGET', KEYS[1], 'blobs', 'request', 'owner'); "
    "for key in string.gmatch(has[1] or '', '%x+') do let_go(key) end "
    "for k = 4, #ARGV do let_go(ARGV[k]) end "
    "if has[2] and has[2] ~= '' then redis.call('DEL', has[2]) end "
    "if has[3] then redis.call('ZREM', 'lpdeform:o:' .. redis.sha1hex(has[3]), KEYS[1]) end "
    "redis.call('DEL', KEYS[1]); return 1";

/// ARGV: holder, epoch. Not where the same holder has taken it over again meanwhile. Nobody holds it then: a touch that was under way
/// does not renew the lease.
const std::string kLetGo =
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch'); "
    "if has[1] == ARGV[1] and has[2] == ARGV[2] then "
    "  redis.call('HSET', KEYS[1], 'holder', '', 'until', 0, 'alive', 0) "
    "end "
    "return 1";

constexpr std::int64_t kDone = 1, kIsBehind = 2, kIsWanted = 3, kIsHeld = -2;  // as scripts answer

ChangeOutcome outcome_of(std::int64_t answer) {
  if (answer == kIsBehind) return ChangeOutcome::kBehind;
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
        writer_(options.host, options.port, options.patience),
        reader_(options.host, options.port, options.patience) {}

  absl::Status ping() {
    const std::scoped_lock lock(reading_);
    return reader_.run({"PING"}).status();
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
  absl::Status let_go(const std::string& session, std::uint64_t epoch) override;
  /// Keys expire by themselves.
  absl::StatusOr<std::size_t> remove_unused(std::int64_t) override { return 0; }

 private:
  Command command_of(const StoredChange& change);
  std::string lease() const { return absl::StrCat(options_.lease.count()); }
  std::string idle() const { return absl::StrCat(options_.idle.count()); }

  const RedisStoreOptions options_;
  const std::string holder_ = random_hex_128();
  std::mutex writing_, reading_;
  RedisConnection writer_, reader_;
  std::mutex pinning_;
  std::map<std::string, std::vector<std::string>> pinned_;  // blobs of sessions that are being made
};

Command RedisStore::command_of(const StoredChange& change) {
  if (change.is_removal) {
    Command command = script(kRemove, change.session);
    command.insert(command.end(), {holder_, change.session, change.is_expiry ? "1" : "0"});
    const std::scoped_lock lock(pinning_);
    const auto pinned = pinned_.find(change.session);
    if (pinned != pinned_.end()) command.insert(command.end(), pinned->second.begin(), pinned->second.end());
    return command;
  }
  Command command = script(kCommit, change.session);
  command.insert(command.end(), {holder_, absl::StrCat(change.epoch_before), absl::StrCat(change.epoch),
                                 lease(), idle(), change.replaces_all ? "1" : "0",
                                 absl::StrCat(change.revision_before), absl::StrCat(change.revision)});
  if (change.epoch_before == 0) {
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
  for (const StoredChange& change : changes) {
    commands.push_back(command_of(change));
    if (change.epoch_before == 0 && !change.is_removal && !change.request_id.empty()) {
      commands.push_back({"SET", request_key(change.owner, change.request_id), change.session, "PX", idle()});
    }
  }
  const std::scoped_lock lock(writing_);
  const auto replies = writer_.run(commands);
  if (!replies.ok()) return replies.status();
  std::vector<ChangeOutcome> outcomes;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    if (commands[k][0] != "EVAL") continue;
    outcomes.push_back(outcome_of((*replies)[k].number));
  }
  const std::scoped_lock pinning(pinning_);
  for (const StoredChange& change : changes) pinned_.erase(change.session);
  return outcomes;
}

absl::StatusOr<StoredSession> RedisStore::take_over(const std::string& session, const std::string& owner,
                                                    const std::string& route) {
  Command command = script(kTakeOver, session);
  command.insert(command.end(),
                 {holder_, owner, lease(), idle(), route, absl::StrCat(options_.stays.count())});
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run(command);
  if (!reply.ok()) return reply.status();
  if (reply->elements.empty()) return session_unknown();
  if (reply->elements[0].number == kIsHeld) return session_elsewhere(reply->elements[1].text);
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
  {
    const std::scoped_lock lock(pinning_);
    pinned_[session].push_back(key);
  }
  const std::scoped_lock lock(reading_);
  const auto known = reader_.run(std::vector<Command>{
      {"SADD", kUsers + key, session}, {"PEXPIRE", kUsers + key, idle()}, {"PEXPIRE", kBlob + key, idle()}});
  if (!known.ok()) return known.status();
  if (known->at(2).number == 1) return absl::OkStatus();
  return reader_.run({"SET", kBlob + key, std::string(bytes), "PX", idle()}).status();
}

absl::StatusOr<std::string> RedisStore::blob(const std::string& key) {
  const std::scoped_lock lock(reading_);
  const auto reply = reader_.run({"GET", kBlob + key});
  if (!reply.ok()) return reply.status();
  if (!reply->is_nothing && blob_key(reply->text) == key) return reply->text;
  return session_damaged(reply->is_nothing ? "its mesh is missing" : "its mesh is not what was written");
}

absl::StatusOr<TouchResult> RedisStore::touch(std::span<const TouchedSession> sessions) {
  TouchResult result;
  if (sessions.empty()) return result;
  std::vector<Command> commands;
  for (const TouchedSession& session : sessions) {
    commands.push_back(script(kTouch, session.name));
    commands.back().insert(commands.back().end(),
                           {holder_, absl::StrCat(session.epoch), lease(),
                            session.is_being_made ? "2" : (session.is_in_use ? "1" : "0"), idle(),
                            absl::StrCat(session.revision)});
  }
  const std::scoped_lock lock(reading_);
  const auto replies = reader_.run(commands);
  if (!replies.ok()) return replies.status();
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    const std::int64_t answer = (*replies)[k].number;
    if (answer == kIsBehind) result.behind.push_back(sessions[k].name);
    if (answer == kIsWanted) result.wanted.push_back(sessions[k].name);
    if (outcome_of(answer) == ChangeOutcome::kFenced && answer != kIsWanted)
      result.lost.push_back(sessions[k].name);
  }
  return result;
}

absl::Status RedisStore::let_go(const std::string& session, std::uint64_t epoch) {
  Command command = script(kLetGo, session);
  command.insert(command.end(), {holder_, absl::StrCat(epoch)});
  const std::scoped_lock lock(writing_);
  return writer_.run(command).status();
}

}  // namespace

absl::StatusOr<std::shared_ptr<Store>> open_redis_store(const RedisStoreOptions& options) {
  auto store = std::make_shared<RedisStore>(options);
  if (absl::Status status = store->ping(); !status.ok()) return status;
  return store;
}

}  // namespace lpdeform
