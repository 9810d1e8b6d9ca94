#pragma once

#include <string>
#include <vector>

#include "client/cpp/types.h"

namespace lpdeform::client {

/// Makes MeshReport::notices from the defects: at border vertices in the same place ("split_border_vertices") the
/// surface splits open unless they are welded. client/python/src/lpdeform/_wire.py and
/// client/web/client/src/fromwire.ts have the same text.
std::vector<std::string> mesh_notices(const std::vector<Defect>& defects);

}  // namespace lpdeform::client
