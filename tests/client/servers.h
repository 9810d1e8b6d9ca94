#pragma once

// The servers of tests that also run on other systems: in this process, or there in serve_tests.

#ifdef LPDEFORM_REMOTE_SERVER
#include "tests/client/remote_server.h"
#else
#include "tests/client/in_process_server.h"
#include "tests/client/lying_server.h"
#include "tests/client/token_server.h"
#endif
