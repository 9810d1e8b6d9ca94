#pragma once

#include <memory>

#include "server/log.h"
#include "server/timers.h"
#include "server/tokens.h"

namespace lpdeform {

/// Has `tokens` look at its file again every other second, for as long as it lives. What is wrong with the file is logged
/// when it begins, and that it is mended.
void watch_keys(const std::shared_ptr<Timers>& timers, const std::shared_ptr<Tokens>& tokens,
                const std::shared_ptr<const Log>& log);

}  // namespace lpdeform
