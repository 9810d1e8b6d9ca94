#include "client/cpp/mesh_notices.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace lpdeform::client {

std::vector<std::string> mesh_notices(const std::vector<Defect>& defects) {
  std::vector<std::string> notices;
  for (const Defect& defect : defects) {
    if (defect.kind != "split_border_vertices" || defect.count == 0) continue;
    const bool are_more = defect.count > static_cast<std::int64_t>(defect.first.size());
    notices.push_back(absl::StrCat("The mesh comes apart where it is split: ", defect.count,
                                   " vertices at its borders lie in the same place as others (vertices ",
                                   absl::StrJoin(defect.first, ", "), are_more ? ", ..." : "",
                                   "). Weld it by position to hold it together there."));
  }
  return notices;
}

}  // namespace lpdeform::client
