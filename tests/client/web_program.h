#pragma once

namespace lpdeform::client {

/// The path of deploy/web.
extern const char* const kWebProgram;

}  // namespace lpdeform::client
