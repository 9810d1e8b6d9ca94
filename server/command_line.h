#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "server/flags.h"

namespace lpdeform {

/// Makes `app` read these flags from the command line and from their environment variables, and tell of them in --help. A value that is
/// not one, or not in its range, is a CLI::ParseError.
void add_flags(CLI::App& app, const std::vector<Flag>& flags);

}  // namespace lpdeform
