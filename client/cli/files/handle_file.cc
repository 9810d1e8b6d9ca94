#include "client/cli/files/handle_file.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/files/hold_keys.h"
#include "client/cli/files/json_values.h"
#include "client/cli/files/point_keys.h"
#include "client/cli/files/text_file.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {
namespace {

std::string name_of(const json& object, const char* list, std::size_t index) {
  const std::string place = absl::StrCat(list, "[", index, "]");
  if (!object.is_object()) refuse_value(place, "an object", object);
  const json& name = required(object, place, "name");
  if (!name.is_string()) refuse_value(key_of(place, "name"), "a text", name);
  std::string text = name.get<std::string>();
  if (text.empty() || text.size() > 128) {
    refuse(Reason::kHandleName, place,
           absl::StrCat("The name of ", place, " has ", text.size(), " bytes; it takes 1 to 128."),
           "1 <= bytes <= 128");
  }
  return text;
}

std::vector<std::uint32_t> vertices_of(const json& object, const std::string& owner,
                                       std::int64_t vertex_count) {
  const json& list = required(object, owner, "vertices");
  const std::string place = key_of(owner, "vertices");
  if (!list.is_array()) refuse_value(place, "a list of vertex numbers", list);
  if (list.empty()) refuse(Reason::kHandleEmpty, owner, absl::StrCat(owner, " has no vertices."));
  return index_list(list, owner, place, "vertex", Reason::kHandleVertexOutOfRange, vertex_count);
}

/// The vertices that may move; empty if the file does not say.
std::vector<std::uint32_t> region_of(const json& file, std::int64_t vertex_count) {
  if (!file.contains("region")) return {};
  const json& list = file["region"];
  if (!list.is_array()) refuse_value("\"region\"", "a list of vertex numbers", list);
  if (list.empty())
    refuse(Reason::kRegionEmpty, "region", "The region of interest has no vertex; nothing could move.");
  return index_list(list, "the region", "\"region\"", "vertex", Reason::kRegionVertexOutOfRange,
                    vertex_count);
}

client::Motion targets_of(const json& object, const std::string& owner, std::size_t vertex_count) {
  const std::string place = key_of(owner, "positions");
  if (object.contains("translate") || object.contains("rotate")) {
    refuse(Reason::kHandleMotionTwice, owner,
           absl::StrCat(
               owner, " has \"positions\" beside \"translate\" or \"rotate\"; it takes one kind of motion."));
  }
  const json& list = object["positions"];
  if (!list.is_array()) refuse_value(place, "a list of [x, y, z]", list);
  if (list.size() != vertex_count) {
    refuse(Reason::kHandleTargetCount, owner,
           absl::StrCat(owner, " has ", list.size(), " positions for ", vertex_count, " vertices or points."),
           absl::StrCat("positions = ", vertex_count));
  }
  client::TargetPositions targets;
  for (const json& point : list) {
    const auto position = vector3(point, place);
    targets.positions.insert(targets.positions.end(), position.begin(), position.end());
  }
  return targets;
}

client::Motion motion_of(const json& object, const std::string& owner, std::size_t vertex_count) {
  if (object.contains("positions")) return targets_of(object, owner, vertex_count);
  if (!object.contains("translate") && !object.contains("rotate")) return client::Fixed{};
  client::RigidMotion rigid;
  if (object.contains("translate"))
    rigid.translation = vector3(object["translate"], key_of(owner, "translate"));
  if (!object.contains("rotate")) return rigid;

  const json& rotate = object["rotate"];
  const std::string place = key_of(owner, "rotate");
  check_keys(rotate, place, {"axis", "angle_degrees", "center"});
  rigid.axis = vector3(required(rotate, place, "axis"), key_of(place, "axis"));
  rigid.angle_radians = number(required(rotate, place, "angle_degrees"), key_of(place, "angle_degrees")) *
                        std::numbers::pi / 180;
  if (rotate.contains("center")) rigid.center = vector3(rotate["center"], key_of(place, "center"));
  if (rigid.axis == std::array<double, 3>{0, 0, 0}) {
    refuse(Reason::kHandleAxisZero, owner,
           absl::StrCat(key_of(place, "axis"), " is [0, 0, 0] and has no direction."));
  }
  return rigid;
}

/// Checks that a vertex is in one handle only, and only once.
class Owners {
 public:
  void claim(const NamedHandle& handle) {
    for (const std::uint32_t vertex : handle.handle.vertices) {
      const auto [place, is_new] = owner_.try_emplace(vertex, handle.name);
      if (is_new) continue;
      const std::string where =
          place->second == handle.name
              ? absl::StrCat("twice in handle \"", handle.name, "\"")
              : absl::StrCat("in handles \"", place->second, "\" and \"", handle.name, "\"");
      refuse(Reason::kHandleVertexTwice, absl::StrCat("vertex ", vertex),
             absl::StrCat("Vertex ", vertex, " is ", where, "; a vertex may be held once, by one handle."));
    }
  }

 private:
  std::map<std::uint32_t, std::string> owner_;
};

/// Parses, and refuses an object with a repeated key. The library would silently keep the later value.
json parse_strictly(std::string_view text) {
  std::vector<std::set<std::string>> keys;
  const auto watch = [&keys](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second) {
      refuse(Reason::kHandleFileKey, parsed.get<std::string>(),
             absl::StrCat("The key ", shown(parsed), " occurs twice in one object."));
    }
    return true;
  };
  try {
    return json::parse(text, watch);
  } catch (const json::exception& error) {
    const std::string what = error.what();
    const std::size_t from = what.find("] ");
    refuse(Reason::kHandleFileSyntax, "",
           absl::StrCat("The handle file is not JSON: ", what.substr(from + 2), "."));
  }
}

std::vector<const char*> handle_keys() {
  std::vector<const char*> keys{"name", "vertices", "points", "translate", "rotate", "positions"};
  for (const char* const key : hold_keys()) keys.push_back(key);
  keys.push_back("footprint");
  return keys;
}

std::vector<NamedHandle> handles_of(const json& file, std::int64_t vertex_count) {
  const json& list = required(file, "the handle file", "handles");
  if (!list.is_array()) refuse_value("\"handles\"", "a list", list);
  if (list.empty())
    refuse(Reason::kHandleFileEmpty, "", "The handle file has no handles; a deformation needs at least one.");
  std::vector<NamedHandle> handles;
  std::set<std::string> names;
  Owners owners;
  for (std::size_t index = 0; index < list.size(); ++index) {
    const json& object = list[index];
    const std::string name = name_of(object, "handles", index);
    const std::string owner = absl::StrCat("handle \"", name, "\"");
    if (!names.insert(name).second)
      refuse(Reason::kHandleNameTwice, owner,
             absl::StrCat("There are two handles of the name \"", name, "\"."));
    check_keys(object, owner, handle_keys());
    NamedHandle& handle = handles.emplace_back(NamedHandle{name, {}});
    if (object.contains("points"))
      handle.handle.points = points_of(object, owner);
    else
      handle.handle.vertices = vertices_of(object, owner, vertex_count);
    const std::size_t count = handle.handle.vertices.size() + handle.handle.points.size();
    handle.handle.motion = motion_of(object, owner, count);
    read_hold(object, owner, handle.handle);
    owners.claim(handle);
  }
  return handles;
}

std::vector<VertexGroup> groups_of(const json& file, std::int64_t vertex_count) {
  std::vector<VertexGroup> groups;
  if (!file.contains("groups")) return groups;
  const json& list = file["groups"];
  if (!list.is_array()) refuse_value("\"groups\"", "a list", list);
  std::set<std::string> names;
  for (std::size_t index = 0; index < list.size(); ++index) {
    const json& object = list[index];
    const std::string name = name_of(object, "groups", index);
    const std::string owner = absl::StrCat("group \"", name, "\"");
    if (!names.insert(name).second)
      refuse(Reason::kHandleNameTwice, owner,
             absl::StrCat("There are two groups of the name \"", name, "\"."));
    check_keys(object, owner, {"name", "vertices", "p", "stiffness"});
    VertexGroup& group = groups.emplace_back(VertexGroup{name, vertices_of(object, owner, vertex_count)});
    if (object.contains("p")) group.p = number(object["p"], key_of(owner, "p"));
    if (object.contains("stiffness"))
      group.stiffness = number(object["stiffness"], key_of(owner, "stiffness"));
  }
  return groups;
}

HandleFile file_of(const json& file, std::int64_t vertex_count) {
  check_keys(file, "the handle file", {"mesh", "note", "handles", "region", "groups"});
  return {handles_of(file, vertex_count), region_of(file, vertex_count), groups_of(file, vertex_count)};
}

}  // namespace

absl::StatusOr<HandleFile> parse_handles(std::string_view text, std::int64_t vertex_count) {
  try {
    return file_of(parse_strictly(text), vertex_count);
  } catch (const Refusal& refusal) {
    return refusal.status;
  }
}

absl::StatusOr<HandleFile> read_handles(const std::filesystem::path& path, std::int64_t vertex_count) {
  const absl::StatusOr<std::string> text = read_text(path);
  if (!text.ok()) return text.status();
  return parse_handles(*text, vertex_count);
}

std::string handle_file_text(const std::vector<NamedHandle>& handles, std::string_view mesh,
                             std::string_view note) {
  nlohmann::ordered_json file{{"mesh", mesh}, {"note", note}, {"handles", nlohmann::ordered_json::array()}};
  for (const NamedHandle& handle : handles) {
    nlohmann::ordered_json object{{"name", handle.name}};
    if (handle.handle.points.empty()) object["vertices"] = handle.handle.vertices;
    write_points(handle.handle.points, object);
    write_hold(handle.handle, object);
    if (const auto* const rigid = std::get_if<client::RigidMotion>(&handle.handle.motion)) {
      object["translate"] = rigid->translation;
      const double degrees = rigid->angle_radians * 180 / std::numbers::pi;
      object["rotate"] = {{"axis", rigid->axis}, {"angle_degrees", degrees}, {"center", rigid->center}};
    } else if (const auto* const targets = std::get_if<client::TargetPositions>(&handle.handle.motion)) {
      auto& points = object["positions"] = nlohmann::ordered_json::array();
      for (std::size_t k = 0; k + 2 < targets->positions.size(); k += 3) {
        points.push_back({targets->positions[k], targets->positions[k + 1], targets->positions[k + 2]});
      }
    }
    file["handles"].push_back(std::move(object));
  }
  return file.dump() + "\n";
}

}  // namespace lpdeform::cli
