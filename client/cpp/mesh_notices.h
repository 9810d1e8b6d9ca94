#pragma once

#include <string>
#include <vector>

#include "client/cpp/types.h"

namespace lpdeform::client {

/// MeshReport::notices, from the defects: vertices at borders that lie in the same place ("split_border_vertices") come
/// apart unless they are welded. client/python/src/lpdeform/_wire.py and client/web/client/src/fromwire.ts say the same.
std::vector<std::string> mesh_notices(const std::vector<Defect>& defects);

}  // namespace lpdeform::client
