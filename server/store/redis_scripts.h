#pragma once

#include <cstdint>
#include <string>

/// What RedisStore has Redis do, in Lua, each of it at once or not at all, and what it answers. The keys: redis_store.h.
namespace lpdeform::redis_scripts {

inline const std::string kSession = "lpdeform:s:", kBlob = "lpdeform:b:";
inline const std::string kPart = "p:";

/// What needs next to no memory, or frees it, is done where Redis is full, too.
inline const std::string kAlways = "#!lua flags=allow-oom\n";

// Of all scripts, KEYS[1] is the session's hash and ARGV[1] the holder, where nothing else is said.
inline const std::string kNow =
    "local t = redis.call('TIME'); local now = t[1] * 1000 + math.floor(t[2] / 1000); ";

/// `ran`: for how long servers have run so far and reached Redis, in milliseconds: what use is dated by.
inline const std::string kRan = "local ran = tonumber(redis.call('HGET', 'lpdeform:time', 'ran') or '0'); ";

/// No keys. ARGV: the longest time between two of these that counts: a longer one passed without servers, or without Redis. `ran`.
inline const std::string kTick =
    kAlways + kNow + kRan +
    "local step = now - tonumber(redis.call('HGET', 'lpdeform:time', 'at') or now); "
    "step = math.max(0, math.min(step, tonumber(ARGV[1]))); "
    "redis.call('HSET', 'lpdeform:time', 'at', now, 'ran', ran + step); return ran + step";

inline const std::string kUsed = kRan + "redis.call('ZADD', 'lpdeform:used', ran, KEYS[1]); ";

/// A function: this blob is no more one of the session's.
inline const std::string kLetGoOf =
    "local function let_go_of(blob, name) "
    "  redis.call('SREM', 'lpdeform:u:' .. blob, name); "
    "  if redis.call('SCARD', 'lpdeform:u:' .. blob) == 0 then redis.call('DEL', 'lpdeform:b:' .. blob) end "
    "end ";

/// A function: all that there is of a session goes. What is left says that it did, and from which epoch on it may be written again, if
/// at all (false: as it was). Of the `most` that went last; `forgot`: when the last one went of which that is no longer known.
inline const std::string kForget =
    kLetGoOf +
    "local function forget(key, epoch, most) "
    "  local name = string.sub(key, 12); "
    "  local has = redis.call('HMGET', key, 'blobs', 'request', 'owner', 'epoch'); "
    "  for blob in string.gmatch(has[1] or '', '%x+') do let_go_of(blob, name) end "
    "  for _, blob in ipairs(redis.call('SMEMBERS', 'lpdeform:m:' .. name)) do let_go_of(blob, name) end "
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

/// A function of what HMGET has of holder and epoch, the epoch that the holder knows as kept, and `ran` when it was last told of its
/// sessions: whether the store has lost the session, or gone back to before that epoch, and nobody has removed it since, nor can have.
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

/// No keys. ARGV: owner, the key of the session before the first, how many. Those that have expired go from the set.
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

/// ARGV: holder, epoch before, epoch, lease, replaces all ("0", "1", or "2" where it is written anew), revision before, revision,
/// `ran` when told, then names and values of hash fields in turn, "=" before a value that is set and "-" for one that goes. 1: done; 0: fenced;
/// 2: behind, which it is not where it has more than that (the answer to the change before was lost), nor where nothing was
/// changed since it was taken over; 4: lost.
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
    "    if not string.find(has[3], blob, 1, true) then let_go_of(blob, name) end "
    "  end "
    "  redis.call('DEL', 'lpdeform:m:' .. name) "
    "end " +
    kUsed + "return 1";

/// Of holders whose presence Redis sees: as long as they listen on a channel of their name. Their connections end with them.
inline const std::string kShown = "shown:", kPresence = "lpdeform:h:";

/// A function: whether this holder has ended. One that is cut off or stopped has not, as far as Redis knows.
inline const std::string kIsGone =
    "local function is_gone(holder) "
    "  if string.sub(holder or '', 1, 6) ~= 'shown:' then return false end "
    "  local listening = redis.pcall('PUBSUB', 'NUMSUB', 'lpdeform:h:' .. holder); "
    "  return not listening.err and listening[2] == 0 "
    "end ";

/// That somebody wants a session is remembered for so many milliseconds.
inline const std::string kWanted = "1000";

/// ARGV: holder, owner, lease, route, stays, by how much the epoch rises. -1: none; -2 and its route: held by another, or for another; else the hash, in
/// the new epoch. `until`: it is in use; `alive`: its holder lives; `since`: it came; `stays`: for so long at least.
inline const std::string kTakeOver =
    kAlways + kNow + kIsGone +
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'owner', 'route', 'wanter'); "
    "if not has[2] or has[2] ~= ARGV[2] then return -1 end "
    "local function number(field) return tonumber(redis.call('HGET', KEYS[1], field) or '0') end "
    "local route, stays = has[3] or '', math.max(number('stays'), tonumber(ARGV[5])); "
    "local is_wanted = now - number('wanted') < " +
    kWanted +
    "; "
    "if has[1] ~= ARGV[1] and not is_gone(has[1]) then "
    "  local is_astray = route ~= '' and ARGV[4] ~= route; "
    "  if number('until') > now or (is_astray and number('alive') > now) then "
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

/// ARGV: holder, epoch, lease, 1 where it is in use and 2 where it is being made, revision, `ran` when told. 0: another has it, or it was
/// removed; 2: it is behind; 3: another wants it; 4: it, or one of its blobs, is lost.
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

/// ARGV: holder, 1 where it goes only if the holder has it in this epoch or one before, epoch, `most_gone`. 0: it has it no more.
inline const std::string kRemove =
    kAlways + kForget +
    "if ARGV[2] == '0' then forget(KEYS[1], 'never', tonumber(ARGV[4])) return 1 end "
    "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch'); "
    "if has[1] and (has[1] ~= ARGV[1] or tonumber(has[2]) > tonumber(ARGV[3])) then return 0 end "
    "forget(KEYS[1], ARGV[3], tonumber(ARGV[4])); return 1";

/// No keys. ARGV: idle, at most how many, `most_gone`. How many went.
inline const std::string kRemoveUnused =
    kAlways + kForget + kRan +
    "local keys = redis.call('ZRANGEBYSCORE', 'lpdeform:used', '-inf', ran - ARGV[1], 'LIMIT', 0, ARGV[2]); "
    "for _, key in ipairs(keys) do forget(key, false, tonumber(ARGV[3])) end "
    "return #keys";

/// ARGV: the blob's key. The session's use of it, which begins before the session is there. 1: the blob is there.
inline const std::string kUseBlob =
    kUsed +
    "local name = string.sub(KEYS[1], 12); "
    "redis.call('SADD', 'lpdeform:m:' .. name, ARGV[1]); redis.call('SADD', 'lpdeform:u:' .. ARGV[1], name); "
    "return redis.call('EXISTS', 'lpdeform:b:' .. ARGV[1])";

/// ARGV: holder, epoch. Not where the same holder has taken it over again meanwhile. Nobody holds it then: a touch that was under way
/// does not renew the lease.
inline const std::string kLetGo = kAlways +
                                  "local has = redis.call('HMGET', KEYS[1], 'holder', 'epoch'); "
                                  "if has[1] == ARGV[1] and has[2] == ARGV[2] then "
                                  "  redis.call('HSET', KEYS[1], 'holder', '', 'until', 0, 'alive', 0) "
                                  "end "
                                  "return 1";

inline constexpr std::int64_t kIsFenced = 0, kDone = 1, kIsBehind = 2, kIsWanted = 3, kHasLostIt = 4,
                              kIsHeld = -2;  // as scripts answer

}  // namespace lpdeform::redis_scripts
