#include "tests/client/web_program.h"

const char* const lpdeform::client::kWebProgram = LPDEFORM_WEB_PROGRAM;
