#include "server/runtime/log.h"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestQueue = 8192;
constexpr std::size_t kDigitsShown = 8;

std::string text_of(const LogField& field) {
  const auto* const text = std::get_if<std::string>(&field.value);
  if (text != nullptr) return *text;
  const auto* const number = std::get_if<std::uint64_t>(&field.value);
  return number == nullptr ? "" : absl::StrCat(*number);
}

/// A line from gRPC itself has its place in gRPC's source as the reason.
LogBound::Kind kind_of(int level, std::string_view event, Log::Fields fields) {
  LogBound::Kind kind{level, std::string(event), "", ""};
  for (const LogField& field : fields) {
    if (field.name == "session") kind.session = text_of(field);
    if (field.name == "reason" || field.name == "file" || field.name == "line")
      absl::StrAppend(&kind.reason, kind.reason.empty() ? "" : ":", text_of(field));
  }
  return kind;
}

}  // namespace

Log::Log(std::string_view level)
    : thread_(std::make_shared<spdlog::details::thread_pool>(kLongestQueue, 1)),
      logger_(std::make_shared<spdlog::async_logger>(
          "lpdeform", std::make_shared<spdlog::sinks::stderr_sink_mt>(), thread_,
          spdlog::async_overflow_policy::overrun_oldest)) {
  logger_->set_pattern("%v");
  auto wanted = spdlog::level::from_str(std::string(level));
  if (wanted == spdlog::level::off && level != "off") wanted = spdlog::level::info;
  logger_->set_level(wanted);
  logger_->flush_on(spdlog::level::info);
}

Log::~Log() {
  end();
}

void Log::end() const {
  const std::scoped_lock lock(mutex_);
  if (thread_ == nullptr) return;
  end_window(Clock::now());
  logger_->set_level(spdlog::level::off);
  thread_.reset();  // writes the queue, and ends before the logger that it writes to
}

void Log::debug(std::string_view event, Fields fields) const {
  write(spdlog::level::debug, event, fields);
}
void Log::info(std::string_view event, Fields fields) const {
  write(spdlog::level::info, event, fields);
}
void Log::warning(std::string_view event, Fields fields) const {
  write(spdlog::level::warn, event, fields);
}

void Log::error(std::string_view event, Fields fields) const {
  write(spdlog::level::err, event, fields);
}

void Log::error_each(std::string_view event, Fields fields) const {
  if (!logger_->should_log(spdlog::level::err)) return;
  wait_for_room();
  const std::scoped_lock lock(mutex_);
  if (thread_ != nullptr) write_line(spdlog::level::err, event, fields);
}

/// Whether the queue has room; other threads fill it, too.
bool Log::has_room() const {
  const std::scoped_lock lock(mutex_);
  return thread_ == nullptr || thread_->queue_size() < kLongestQueue / 2;
}

/// Waits the full time only once: if the queue is still stuck, the next call does not wait, and the oldest
/// lines are dropped.
void Log::wait_for_room() const {
  const Clock::time_point end = Clock::now() + (is_stuck_ ? std::chrono::seconds(0) : kStall);
  while (!has_room()) {
    if (Clock::now() >= end) {
      is_stuck_ = true;
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  is_stuck_ = false;
}

void Log::write(int level, std::string_view event, Fields fields) const {
  if (!logger_->should_log(static_cast<spdlog::level::level_enum>(level))) return;
  if (level == spdlog::level::debug) return write_line(level, event, fields);
  const LogBound::Kind kind = kind_of(level, event, fields);
  const std::scoped_lock lock(mutex_);
  if (thread_ == nullptr) return;
  if (const Clock::time_point now = Clock::now(); now - window_began_ >= kWindow) end_window(now);
  if (bound_.admits(kind)) write_line(level, event, fields);
}

void Log::sum_up() const {
  const std::scoped_lock lock(mutex_);
  if (thread_ == nullptr) return;
  if (const Clock::time_point now = Clock::now(); now - window_began_ >= kWindow) end_window(now);
}

/// Called with the lock held.
void Log::end_window(Clock::time_point now) const {
  const double seconds = std::chrono::duration<double>(now - window_began_).count();
  for (const auto& [kind, count] : bound_.take()) {
    write_line(
        kind.level, "left_out",
        {{"of", kind.event},
         {"session", kind.session},
         {"reason", kind.reason},
         {"count", count},
         {"seconds", seconds},
         {"text", absl::StrCat(kind.event, " ", count, " more times in ", std::lround(seconds), " s")}});
  }
  window_began_ = now;
  if (const std::size_t lost = thread_->overrun_counter(); lost != lines_lost_) {
    write_line(
        spdlog::level::warn, "lines_lost",
        {{"count", std::uint64_t{lost - lines_lost_}}, {"text", "The reader of the log is too slow."}});
    lines_lost_ = lost;
  }
}

void Log::write_line(int level, std::string_view event, Fields fields) const {
  const auto at = static_cast<spdlog::level::level_enum>(level);
  nlohmann::ordered_json line;
  line["time"] = absl::FormatTime(absl::RFC3339_full, absl::Now(), absl::UTCTimeZone());
  line["level"] = spdlog::level::to_string_view(at).data();
  line["event"] = event;
  for (const LogField& field : fields) {
    const auto* const text = std::get_if<std::string>(&field.value);
    if (text != nullptr && text->empty()) continue;
    std::visit([&](const auto& value) { line[std::string(field.name)] = value; }, field.value);
  }
  logger_->log(at, line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string abbreviated(std::string_view name) {
  const std::size_t slash = name.rfind('/');
  return std::string(name.substr(slash == std::string_view::npos ? 0 : slash + 1, kDigitsShown));
}

std::string in_quotes(std::string_view text) {
  std::string out;
  std::size_t digits = 0;  // in the current run
  for (const char c : text.substr(0, kLongestQuote)) {
    digits = std::isxdigit(static_cast<unsigned char>(c)) != 0 ? digits + 1 : 0;
    if (digits <= kDigitsShown) out.push_back(c);
  }
  return out;
}

}  // namespace lpdeform
