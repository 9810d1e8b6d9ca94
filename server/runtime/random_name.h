#pragma once

#include <string>
#include <string_view>

namespace lpdeform {

/// 128 bits from the system's source of randomness as 32 hexadecimal digits: names that cannot be guessed,
/// tokens. Thread-safe.
std::string random_hex_128();

/// Whether the text is "sessions/" and 32 hexadecimal digits, as every session is named.
bool is_session_name(std::string_view text);

}  // namespace lpdeform
