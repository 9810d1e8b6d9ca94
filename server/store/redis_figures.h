#pragma once

#include <string>

#include "server/store/store.h"

namespace lpdeform {

/// What Redis says of itself in answer to INFO, as far as operators of lpdeform need it. What it does not say is 0 or false.
StoreFigures redis_figures(const std::string& info);

}  // namespace lpdeform
