#pragma once

#include <string_view>

namespace lpdeform {

/// Whether a request for `authority` (HTTP's Host: "NAME", "NAME:PORT") names this machine: localhost and
/// names below it, 127.0.0.0/8, [::1]. This protects against DNS rebinding: a page of another site can make
/// its own name resolve to 127.0.0.1 while it is open, and then call local services as if they were its own.
/// The name that its browser sends is still that of the site.
bool names_this_machine(std::string_view authority);

}  // namespace lpdeform
