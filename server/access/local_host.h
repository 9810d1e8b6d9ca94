#pragma once

#include <string_view>

namespace lpdeform {

/// Whether a request that says it is for `authority` (HTTP's Host: "NAME", "NAME:PORT") names this machine: localhost and names below
/// it, 127.0.0.0/8, [::1]. A page of any other site can make its own name mean 127.0.0.1 while it is open (DNS rebinding), and then call
/// what listens there as if it were its own; the name that its browser sends is still the site's.
bool names_this_machine(std::string_view authority);

}  // namespace lpdeform
