#include "server/log.h"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestQueue = 8192;
constexpr std::size_t kDigitsShown = 8;

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
  thread_.reset();  // writes what waits, and ends before the logger that it writes to
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

void Log::write(int level, std::string_view event, Fields fields) const {
  const auto at = static_cast<spdlog::level::level_enum>(level);
  if (!logger_->should_log(at)) return;
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

}  // namespace lpdeform
