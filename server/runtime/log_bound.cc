#include "server/runtime/log_bound.h"

#include <algorithm>

namespace lpdeform {

bool LogBound::admits(const Kind& kind) {
  Lines& lines = lines_[{kind.event, kind.reason}];
  lines.level = std::max(lines.level, kind.level);
  const auto known = lines.of_sessions.find(kind.session);
  const bool is_known = known != lines.of_sessions.end();
  if (lines.all.written == kOfAReason && !is_known) {
    ++lines.all.left_out;
    return false;
  }
  Count& own = is_known ? known->second : lines.of_sessions[kind.session];
  if (own.written == kOfASession || lines.all.written == kOfAReason) {
    ++own.left_out;
    return false;
  }
  ++own.written;
  ++lines.all.written;
  return true;
}

std::vector<LogBound::LeftOut> LogBound::take() {
  std::vector<LeftOut> out;
  for (const auto& [name, lines] : lines_) {
    const auto& [event, reason] = name;
    for (const auto& [session, count] : lines.of_sessions) {
      if (count.left_out > 0) out.push_back({{lines.level, event, reason, session}, count.left_out});
    }
    if (lines.all.left_out > 0) out.push_back({{lines.level, event, reason, ""}, lines.all.left_out});
  }
  lines_.clear();
  return out;
}

}  // namespace lpdeform
