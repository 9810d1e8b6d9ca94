#pragma once

#include <string>

namespace lpdeform {

/// 128 bits from the system's source of randomness as 32 hexadecimal digits: names that cannot be guessed,
/// tokens. Thread-safe.
std::string random_hex_128();

}  // namespace lpdeform
