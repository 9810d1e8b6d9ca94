#include "server/store/redis_connection.h"

#include <hiredis.h>
#include <sys/time.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/store/store.h"

namespace lpdeform {
namespace {

constexpr char kIsEnding[] = "it had not answered when the server ended";

timeval time_of(std::chrono::milliseconds duration) {
  return {duration.count() / 1000, 1000 * (duration.count() % 1000)};
}

RedisReply read(const redisReply& reply) {
  RedisReply out;
  out.is_nothing = reply.type == REDIS_REPLY_NIL;
  out.number = reply.integer;
  if (reply.str != nullptr) out.text.assign(reply.str, reply.len);
  for (std::size_t k = 0; k < reply.elements; ++k) out.elements.push_back(read(*reply.element[k]));
  return out;
}

}  // namespace

void RedisConnection::Free::operator()(redisContext* context) const {
  redisFree(context);
}

RedisConnection::RedisConnection(std::string host, int port, std::chrono::milliseconds patience,
                                 RedisLogin login)
    : host_(std::move(host)), port_(port), patience_(patience), login_(std::move(login)) {}

RedisConnection::~RedisConnection() = default;

std::string RedisConnection::place() const {
  return absl::StrCat("Redis at ", host_, ":", port_);
}

absl::Status RedisConnection::failure(const std::string& what) {
  context_.reset();
  return store_failing(what, place());
}

absl::Status RedisConnection::no_answer(const std::string& what) {
  context_.reset();
  return store_away(what, place());
}

/// For one answer. It is 0 or negative when no time is left.
std::chrono::milliseconds RedisConnection::time_left() const {
  const auto end = end_.load();
  if (end == std::chrono::steady_clock::time_point::max()) return patience_;
  const auto left = end - std::chrono::steady_clock::now();
  return std::min(patience_, std::chrono::duration_cast<std::chrono::milliseconds>(left));
}

absl::Status RedisConnection::connect() {
  if (context_ != nullptr) return absl::OkStatus();
  const auto left = time_left();
  if (left.count() <= 0) return no_answer(kIsEnding);
  context_.reset(redisConnectWithTimeout(host_.c_str(), port_, time_of(left)));
  if (context_ == nullptr) return no_answer("no memory");
  if (context_->err != 0) return no_answer(context_->errstr);
  redisSetTimeout(context_.get(), time_of(patience_));
  redisEnableKeepAlive(context_.get());
  return log_in();
}

absl::Status RedisConnection::log_in() {
  if (login_.password_file.empty()) return absl::OkStatus();
  std::ifstream file(login_.password_file);
  std::string password;
  if (!std::getline(file, password) || password.empty())
    return failure(absl::StrCat("no password can be read in ", login_.password_file));
  Command command{"AUTH", std::move(password)};
  if (!login_.user.empty()) command.insert(command.begin() + 1, login_.user);
  return send({command}).status();
}

absl::StatusOr<RedisReply> RedisConnection::run(const Command& command) {
  auto replies = run(std::vector<Command>{command});
  if (!replies.ok()) return replies.status();
  return std::move(replies->front());
}

absl::StatusOr<std::vector<RedisReply>> RedisConnection::run(const std::vector<Command>& commands) {
  if (absl::Status status = connect(); !status.ok()) return status;
  return send(commands);
}

absl::StatusOr<std::vector<RedisReply>> RedisConnection::send(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    std::vector<const char*> texts;
    std::vector<std::size_t> sizes;
    for (const std::string& word : command) {
      texts.push_back(word.data());
      sizes.push_back(word.size());
    }
    redisAppendCommandArgv(context_.get(), static_cast<int>(texts.size()), texts.data(), sizes.data());
  }
  std::vector<RedisReply> replies;
  std::string refused;
  while (replies.size() < commands.size()) {
    const auto left = time_left();
    if (left.count() <= 0) return no_answer(kIsEnding);
    if (left < patience_) redisSetTimeout(context_.get(), time_of(left));
    void* received = nullptr;
    if (redisGetReply(context_.get(), &received) != REDIS_OK) return no_answer(context_->errstr);
    const std::unique_ptr<redisReply, void (*)(void*)> reply(static_cast<redisReply*>(received),
                                                             freeReplyObject);
    if (reply->type == REDIS_REPLY_ERROR && refused.empty()) refused.assign(reply->str, reply->len);
    replies.push_back(read(*reply));
  }
  if (refused.empty()) return replies;
  // "OOM" is how Redis says that it is over maxmemory.
  if (absl::StartsWith(refused, "OOM")) return store_full(refused, "", place());
  return failure(refused);
}

}  // namespace lpdeform
