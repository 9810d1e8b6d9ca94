#include "tests/client/web_front.h"

const char* const lpdeform::client::kWebProgram = LPDEFORM_WEB_PROGRAM;
