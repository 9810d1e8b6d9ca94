#pragma once

#include <string>

namespace lpdeform::client {

/// Why the system does not trust the certificate at the other end of `context`, a CtxtHandle of Schannel after its
/// handshake, for the server `host`; empty if it does. On Windows alone. Schannel has asked the same before, but not Wine's,
/// which takes every certificate.
std::string why_not_trusted(void* context, const std::string& host);

}  // namespace lpdeform::client
