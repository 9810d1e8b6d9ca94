#include "client/cli/local_server.h"
