#pragma once

#include <string>
#include <string_view>

namespace lpdeform {

/// 128 bits from the system's source of randomness as 32 hexadecimal digits. Used for tokens and for names
/// that must not be guessed. Thread-safe.
std::string random_hex_128();

/// Whether the text is "sessions/" and 32 hexadecimal digits, like every session's name.
bool is_session_name(std::string_view text);

}  // namespace lpdeform
