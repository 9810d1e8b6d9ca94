#pragma once

#include <string>

namespace lpdeform {

/// Opens a new connection to the server at `address` and asks its health service whether it serves `service`
/// (the full name; empty: the server as a whole). Returns false also if no answer comes within 3 seconds.
bool is_serving(const std::string& address, const std::string& service = "");

}  // namespace lpdeform
