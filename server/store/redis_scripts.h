#pragma once

#include <cstdint>
#include <string>

/// The Lua scripts that RedisStore runs in Redis, and their answers. Each script is atomic. redis_store.h
/// lists the keys.
namespace lpdeform::redis_scripts {

inline const std::string kSession = "lpdeform:s:", kBlob = "lpdeform:b:";
inline const std::string kPart = "p:";

/// For scripts that need next to no memory, or free it: they run when Redis is full, too.
inline const std::string kAlways = "#!lua flags=allow-oom\n";

// In all scripts KEYS[1] is the session's hash and ARGV[1] the holder, unless the comment says otherwise.
inline const std::string kNow =
    "local t = redis.call('TIME'); local now = t[1] * 1000 + math.floor(t[2] / 1000); ";

/// `ran`: for how long servers have run so far and reached Redis, in milliseconds. The last use of a session
/// is dated by it.
inline const std::string kRan = "local ran = tonumber(redis.call('HGET', 'lpdeform:time', 'ran') or '0'); ";

/// A function: the last outage. In an outage no server calls kTick for more than half of a lease: Redis or its
/// disk hangs, or no server runs. Argument: the lease. Returns `away` and `back`, the times of the last call before it
/// and of the first one after it (now, as long as it lasts), and `first`. Outages that begin less than two leases after
/// `first`, when the first of them ended, count as one, with the `away` of the first. 0, 0, 0 if there was none.
inline const std::string kOutage =
    "local function outage(lease) "
    "  local has = redis.call('HMGET', 'lpdeform:time', 'at', 'away', 'back', 'first'); "
    "  local at, away = tonumber(has[1] or now), tonumber(has[2] or 0); "
    "  local back, first = tonumber(has[3] or 0), tonumber(has[4] or 0); "
    "  if now - at <= lease / 2 then return away, back, first end "
    "  if first <= at and at - first < 2 * lease then return away, now, first end "
    "  return at, now, now "
    "end ";

/// Advances `ran` and returns it. Each server calls it a third of a lease after its last call was answered. No keys. ARGV: the
/// lease, which is also the longest time between two calls that counts; during a longer one no server ran, or none reached
/// Redis.
inline const std::string kTick =
    kAlways + kNow + kRan + kOutage +
    "local step = now - tonumber(redis.call('HGET', 'lpdeform:time', 'at') or now); "
    "step = math.max(0, math.min(step, tonumber(ARGV[1]))); "
    "local away, back, first = outage(tonumber(ARGV[1])); "
    "redis.call('HSET', 'lpdeform:time', 'at', now, 'ran', ran + step, 'away', away, 'back', back, 'first', "
    "first); "
    "return ran + step";

inline const std::string kUsed = kRan + "redis.call('ZADD', 'lpdeform:used', ran, KEYS[1]); ";

/// A function: takes this blob away from the session.
inline const std::string kLetGoOf =
    "local function release_blob(blob, name) "
    "  redis.call('SREM', 'lpdeform:u:' .. blob, name); "
    "  if redis.call('SCARD', 'lpdeform:u:' .. blob) == 0 then redis.call('DEL', 'lpdeform:b:' .. blob) end "
    "end ";

/// A function: removes everything of a session. It remembers that the session was removed, and the epoch from
/// which on the session may be written again: 'never', a given epoch, or (false) the epoch that it had. The
/// newest `most` removals are remembered. `forgot` is the `ran` of the newest removal that no longer is.
inline const std::string kForget =
    kLetGoOf +
    "local function forget(key, epoch, most) "
    "  local name = string.sub(key, 12); "
    "  local has = redis.call('HMGET', key, 'blobs', 'request', 'owner', 'epoch'); "
    "  for blob in string.gmatch(has[1] or '', '%x+') do release_blob(blob, name) end "
    "  for _, blob in ipairs(redis.call('SMEMBERS', 'lpdeform:m:' .. name)) do release_blob(blob, name) end "
    "  if has[2] and has[2] ~= '' then redis.call('DEL', has[2]) end "
    "  if has[3] then redis.call('ZREM', 'lpdeform:o:' .. redis.sha1hex(has[3]), key) end "
    "  redis.call('ZREM', 'lpdeform:used', key); "
    "  redis.call('DEL', key, 'lpdeform:m:' .. name); "
    "  redis.call('ZADD', 'lpdeform:gone', redis.call('HGET', 'lpdeform:time', 'ran') or 0, name); "
    "  if epoch == 'never' then redis.call('HDEL', 'lpdeform:gone:epochs', name) "
    "  else redis.call('HSET', 'lpdeform:gone:epochs', name, epoch or has[4] or '0') end "
    "  local over = redis.call('ZCARD', 'lpdeform:gone') - most; "
    "  if over > 0 then "
    "    local went = redis.call('ZPOPMIN', 'lpdeform:gone', over); "
    "    for k = 1, #went, 2 do redis.call('HDEL', 'lpdeform:gone:epochs', went[k]) end "
    "    redis.call('HSET', 'lpdeform:time', 'forgot', went[#went]) "
    "  end "
    "end ";

/// A function: whether the store has lost the session, or has gone back to before the given epoch, while
/// nobody can have removed the session. Arguments: HMGET of holder and epoch; the epoch that the holder knows
/// as stored; `ran` when the holder last heard of its sessions.
inline const std::string kIsLost =
    "local function is_lost(has, epoch, told) "
    "  if has[1] then return tonumber(has[2]) < tonumber(epoch) end "
    "  local name = string.sub(KEYS[1], 12); "
    "  if redis.call('ZSCORE', 'lpdeform:gone', name) then "
    "    local from = redis.call('HGET', 'lpdeform:gone:epochs', name); "
    "    return from and tonumber(from) <= tonumber(epoch) "
    "  end "
    "  local forgot = redis.call('HGET', 'lpdeform:time', 'forgot'); "
    "  return not (forgot and tonumber(told) <= tonumber(forgot)) "
    "end ";

/// Lists an owner's sessions. No keys. ARGV: owner, the key after which the list begins, how many. Removes
/// entries of sessions that no longer exist.
inline const std::string kList =
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

/// Writes a change. ARGV: holder, epoch before, epoch, lease, mode ("0": change some parts, "1": replace all
/// parts, "2": write a lost session again), revision before, revision, `ran` when the holder last heard of
/// its sessions. Then names and values of hash fields in turn, with "=" before a value to set and "-" for a
/// field to delete. Answers: 1: done; 0: fenced; 2: behind; 4: lost. It is not behind if the store has a
/// higher revision (the answer to the change before was lost), nor if nothing was changed since the session
/// was taken over.
inline const std::string kCommit =
    kNow + kIsLost + kLetGoOf +
    "local name = string.sub(KEYS[1], 12); "
    "if ARGV[2] ~= '0' then "
    "  local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch', 'revision'); "
    "  if is_lost(has, ARGV[2], ARGV[8]) then "
    "    if ARGV[5] ~= '2' then return 4 end "
    "  else "
    "    if has[1] ~= ARGV[1] or (has[2] ~= ARGV[2] and has[2] ~= ARGV[3]) then return 0 end "
    "    if ARGV[5] == '0' and has[3] and tonumber(has[3]) < tonumber(ARGV[6]) then return 2 end "
    "  end "
    "end "
    "local blobs_before = redis.call('HGET', KEYS[1], 'blobs') or ''; "
    "if ARGV[5] == '2' then redis.call('DEL', KEYS[1]) end "
    "if ARGV[5] == '1' then "
    "  for _, field in ipairs(redis.call('HKEYS', KEYS[1])) do "
    "    if string.sub(field, 1, 2) == 'p:' then redis.call('HDEL', KEYS[1], field) end "
    "  end "
    "end "
    "redis.call('HSET', KEYS[1], 'holder', ARGV[1], 'epoch', ARGV[3], 'until', now + ARGV[4], 'alive', now + "
    "ARGV[4], 'revision', ARGV[7]); "
    "for k = 9, #ARGV, 2 do "
    "  if string.sub(ARGV[k + 1], 1, 1) == '=' then redis.call('HSET', KEYS[1], ARGV[k], string.sub(ARGV[k + "
    "1], 2)) "
    "  else redis.call('HDEL', KEYS[1], ARGV[k]) end "
    "end "
    "if ARGV[2] == '0' or ARGV[5] == '2' then "
    "  local has = redis.call('HMGET', KEYS[1], 'owner', 'request', 'blobs'); "
    "  redis.call('ZADD', 'lpdeform:o:' .. redis.sha1hex(has[1]), 0, KEYS[1]); "
    "  if has[2] and has[2] ~= '' then redis.call('SET', has[2], name) end "
    "  for blob in string.gmatch(blobs_before, '%x+') do "
    "    if not string.find(has[3], blob, 1, true) then release_blob(blob, name) end "
    "  end "
    "  redis.call('DEL', 'lpdeform:m:' .. name) "
    "end " +
    kUsed + "return 1";

/// The prefix of holders whose presence Redis can see. Each listens on a channel of its name, as long as its
/// connection lives.
inline const std::string kShown = "shown:", kPresence = "lpdeform:h:";

/// A function: whether this holder's process has ended. A server that is cut off or stopped has not ended as
/// far as Redis knows.
inline const std::string kIsGone =
    "local function is_gone(holder) "
    "  if string.sub(holder or '', 1, 6) ~= 'shown:' then return false end "
    "  local listening = redis.pcall('PUBSUB', 'NUMSUB', 'lpdeform:h:' .. holder); "
    "  return not listening.err and listening[2] == 0 "
    "end ";

/// For how many milliseconds Redis remembers that a server wants a session.
inline const std::string kWanted = "1000";

/// Takes a session over. ARGV: holder, owner, lease, route, stays, by how much the epoch rises. Answers: -1:
/// no such session; -2 and the session's route: another holder has it, or another one is to get it; else the
/// hash, in the new epoch. Fields of the hash: `until`: end of the lease while it is in use; `alive`: end of
/// the lease while its holder lives; `since`: when it was taken over; `stays`: for how long at least it stays
/// with its holder. A lease that ended during an outage counts for one lease after it, so that its holder can
/// renew it. For that time no holder counts as gone, since it may have to connect again.
inline const std::string kTakeOver =
    kAlways + kNow + kIsGone + kOutage +
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'owner', 'route', 'wanter'); "
    "if not has[2] or has[2] ~= ARGV[2] then return -1 end "
    "local function number(field) return tonumber(redis.call('HGET', KEYS[1], field) or '0') end "
    "local route, stays = has[3] or '', math.max(number('stays'), tonumber(ARGV[5])); "
    "local away, back = outage(tonumber(ARGV[3])); "
    "local is_just_back = back <= now and now - back < tonumber(ARGV[3]); "
    "local function is_leased(field) "
    "  return number(field) > (is_just_back and away or now) "
    "end "
    "local is_wanted = now - number('wanted') < " +
    kWanted +
    "; "
    "if has[1] ~= ARGV[1] and (is_just_back or not is_gone(has[1])) then "
    "  local is_misrouted = route ~= '' and ARGV[4] ~= route; "
    "  if is_leased('until') or (is_misrouted and is_leased('alive')) then "
    "    if route ~= '' and route == ARGV[4] and now - number('since') > stays and "
    "      (not is_wanted or has[4] == ARGV[1]) then "
    "      redis.call('HSET', KEYS[1], 'wanted', now, 'wanter', ARGV[1]) "
    "    end "
    "    return {-2, route} "
    "  end "
    "end "
    "if is_wanted and has[4] ~= ARGV[1] and not is_gone(has[4]) then return {-2, route} end "
    "local is_back_soon = is_wanted and now - number('since') < 4 * stays; "
    "stays = is_back_soon and math.min(2 * stays, 32 * ARGV[5]) or tonumber(ARGV[5]); "
    "redis.call('HINCRBY', KEYS[1], 'epoch', ARGV[6]); "
    "redis.call('HSET', KEYS[1], 'holder', ARGV[1], 'until', now + ARGV[3], 'alive', now + ARGV[3], 'since', "
    "now, "
    "'stays', stays); "
    "redis.call('HDEL', KEYS[1], 'revision', 'wanted', 'wanter'); " +
    kUsed + "return redis.call('HGETALL', KEYS[1])";

/// Renews a lease. ARGV: holder, epoch, lease, use (0: unused, 1: in use, 2: being made), revision, `ran`
/// when the holder last heard of its sessions. Answers: 1: done; 0: another holder has the session, or it was
/// removed; 2: the store is behind; 3: another server wants the session; 4: the store lost the session or one
/// of its blobs.
inline const std::string kTouch =
    kAlways + kNow + kIsLost +
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch', 'blobs', 'revision', 'wanted'); "
    "if is_lost(has, ARGV[2], ARGV[6]) then return 4 end "
    "if has[1] ~= ARGV[1] then return 0 end "
    "redis.call('HSET', KEYS[1], 'alive', now + ARGV[3]); "
    "if ARGV[4] ~= '0' then redis.call('HSET', KEYS[1], 'until', now + ARGV[3]) end "
    "if ARGV[4] == '2' then redis.call('HSET', KEYS[1], 'since', now) end " +
    kUsed +
    "for blob in string.gmatch(has[3] or '', '%x+') do "
    "  if redis.call('EXISTS', 'lpdeform:b:' .. blob) == 0 then return 4 end "
    "end "
    "if has[4] and tonumber(has[4]) < tonumber(ARGV[5]) then return 2 end "
    "if has[5] and now - tonumber(has[5]) < " +
    kWanted + " then return 3 end return 1";

/// Removes a session. ARGV: holder; 1 if only a session that the holder has in this epoch or an earlier one
/// may be removed; epoch; `most_gone`. Answers: 1: removed; 0: the holder does not have it any more.
inline const std::string kRemove =
    kAlways + kForget +
    "if ARGV[2] == '0' then forget(KEYS[1], 'never', tonumber(ARGV[4])) return 1 end "
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch'); "
    "if has[1] and (has[1] ~= ARGV[1] or tonumber(has[2]) > tonumber(ARGV[3])) then return 0 end "
    "forget(KEYS[1], ARGV[3], tonumber(ARGV[4])); return 1";

/// Removes unused sessions. No keys. ARGV: for how long unused, how many at most, `most_gone`. Answer: how
/// many were removed.
inline const std::string kRemoveUnused =
    kAlways + kForget + kRan +
    "local keys = redis.call('ZRANGEBYSCORE', 'lpdeform:used', '-inf', ran - ARGV[1], 'LIMIT', 0, ARGV[2]); "
    "for _, key in ipairs(keys) do forget(key, false, tonumber(ARGV[3])) end "
    "return #keys";

/// Notes that the session uses a blob, also before the session exists. ARGV: the blob's key. Answer: 1: the
/// blob exists.
inline const std::string kUseBlob =
    kUsed +
    "local name = string.sub(KEYS[1], 12); "
    "redis.call('SADD', 'lpdeform:m:' .. name, ARGV[1]); redis.call('SADD', 'lpdeform:u:' .. ARGV[1], name); "
    "return redis.call('EXISTS', 'lpdeform:b:' .. ARGV[1])";

/// Releases a session, unless the same holder has taken it over again meanwhile. ARGV: holder, epoch.
/// Afterwards the session has no holder, so a touch that was under way does not renew the lease.
inline const std::string kLetGo = kAlways +
                                  "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch'); "
                                  "if has[1] == ARGV[1] and has[2] == ARGV[2] then "
                                  "  redis.call('HSET', KEYS[1], 'holder', '', 'until', 0, 'alive', 0) "
                                  "end "
                                  "return 1";

inline constexpr std::int64_t kIsFenced = 0, kDone = 1, kIsBehind = 2, kIsWanted = 3, kHasLostIt = 4,
                              kIsHeld = -2;  // answers of the scripts

}  // namespace lpdeform::redis_scripts
