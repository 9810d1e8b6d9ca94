#pragma once

#include "DynamicMesh/DynamicMesh3.h"
