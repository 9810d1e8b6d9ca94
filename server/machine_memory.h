#pragma once

#include <cstddef>

namespace lpdeform {

/// The bytes of memory that this process may have: the machine's, or what its control group (v2 or v1) may have where that is
/// less.
std::size_t memory_of_process();

}  // namespace lpdeform
