#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/cpp/types.h"

namespace lpdeform::cli {

/// How many energies there are, where one that is at most 0.1 % above the next lower one is not counted. Minima of different
/// energies are different; those of one energy may be different, too, as mirror images are.
std::size_t different_energies(std::vector<double> minima);

/// What was searched, in one line for people. The certificate does not say it: it is about the rotations of the result, and
/// another minimum may be lower. Claims nothing that the result does not say, also where a limit has cut the search off or
/// where the server is older than the search.
std::string search_text(const client::SolveResult& result);

}  // namespace lpdeform::cli
