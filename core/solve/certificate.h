#pragma once
#include "core/solve/minimiser.h"
