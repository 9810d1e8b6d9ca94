#pragma once

#include <string>

namespace lpdeform {

/// Opens a new connection to the server at `address` and asks its health service whether it serves; false
/// also where no answer comes within 3 seconds.
bool is_serving(const std::string& address);

}  // namespace lpdeform
