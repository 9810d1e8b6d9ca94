#pragma once

#include <string>

#include "server/store/store.h"

namespace lpdeform {

/// What Redis reports of itself in answer to INFO, as far as operators of lpdeform need it. Values that Redis
/// does not report are 0 or false.
StoreFigures redis_figures(const std::string& info);

}  // namespace lpdeform
