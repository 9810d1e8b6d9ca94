#include "client/cli/handle_file.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/text_file.h"
#include "core/base/fault.h"

namespace lpdeform::cli {
namespace {

using nlohmann::json;

/// Thrown and caught inside this file only, so that reading a value can be an expression.
struct Refusal {
  absl::Status status;
};

[[noreturn]] void refuse(const char* reason, std::string element, std::string_view text,
                         std::string limit = "") {
  throw Refusal{invalid_input({reason, std::move(element), std::move(limit)}, text)};
}

/// What is being read, for messages: `handle "tip"`, then `"rotate" of handle "tip"`.
std::string key_of(const std::string& owner, const char* key) {
  return absl::StrCat("\"", key, "\" of ", owner);
}

/// `value` for a message. Not dumped where it is nested: that would recurse as deep as a hostile file likes.
std::string shown(const json& value) {
  const bool is_nested =
      std::ranges::any_of(value, [](const json& inner) { return inner.is_structured() && !inner.empty(); });
  if (value.is_structured() && is_nested) return value.is_array() ? "a nested list" : "a nested object";
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

[[noreturn]] void refuse_value(const std::string& place, const char* wanted, const json& value) {
  refuse("HANDLE_FILE_VALUE", place, absl::StrCat(place, " must be ", wanted, ", not ", shown(value), "."));
}

void check_keys(const json& object, const std::string& owner, std::initializer_list<const char*> known) {
  if (!object.is_object()) refuse_value(owner, "an object", object);
  for (const auto& [key, value] : object.items()) {
    if (std::ranges::find(known, key) != known.end()) continue;
    refuse("HANDLE_FILE_KEY", owner,
           absl::StrCat(owner, " has the unknown key \"", key, "\"; known are ", absl::StrJoin(known, ", "),
                        "."));
  }
}

const json& required(const json& object, const std::string& owner, const char* key) {
  if (!object.contains(key)) {
    refuse("HANDLE_FILE_KEY", owner, absl::StrCat(owner, " has no \"", key, "\"."));
  }
  return object[key];
}

double number(const json& value, const std::string& place) {
  if (!value.is_number()) refuse_value(place, "a number", value);
  return value.get<double>();
}

std::array<double, 3> vector3(const json& value, const std::string& place) {
  if (!value.is_array() || value.size() != 3) refuse_value(place, "three numbers [x, y, z]", value);
  return {number(value[0], place), number(value[1], place), number(value[2], place)};
}

std::string name_of(const json& object, const char* list, std::size_t index) {
  const std::string place = absl::StrCat(list, "[", index, "]");
  if (!object.is_object()) refuse_value(place, "an object", object);
  const json& name = required(object, place, "name");
  if (!name.is_string()) refuse_value(key_of(place, "name"), "a text", name);
  std::string text = name.get<std::string>();
  if (text.empty() || text.size() > 128) {
    refuse("HANDLE_NAME", place,
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
  if (list.empty()) refuse("HANDLE_EMPTY", owner, absl::StrCat(owner, " has no vertices."));
  std::vector<std::uint32_t> vertices;
  for (const json& vertex : list) {
    if (!vertex.is_number_integer()) refuse_value(place, "whole numbers from 0", vertex);
    const bool is_in_range =
        vertex.is_number_unsigned() ? vertex.get<std::uint64_t>() < std::uint64_t(vertex_count) : false;
    if (!is_in_range) {
      refuse("HANDLE_VERTEX_OUT_OF_RANGE", owner,
             absl::StrCat(owner, " has vertex ", shown(vertex), ", and the mesh has vertices 0 to ",
                          vertex_count - 1, "."),
             absl::StrCat("0 <= vertex < ", vertex_count));
    }
    vertices.push_back(vertex.get<std::uint32_t>());
  }
  return vertices;
}

client::Motion targets_of(const json& object, const std::string& owner, std::size_t vertex_count) {
  const std::string place = key_of(owner, "positions");
  if (object.contains("translate") || object.contains("rotate")) {
    refuse("HANDLE_MOTION_TWICE", owner,
           absl::StrCat(
               owner, " has \"positions\" beside \"translate\" or \"rotate\"; it takes one kind of motion."));
  }
  const json& list = object["positions"];
  if (!list.is_array()) refuse_value(place, "a list of [x, y, z]", list);
  if (list.size() != vertex_count) {
    refuse("HANDLE_TARGET_COUNT", owner,
           absl::StrCat(owner, " has ", list.size(), " positions for ", vertex_count, " vertices."),
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
    refuse("HANDLE_AXIS_ZERO", owner,
           absl::StrCat(key_of(place, "axis"), " is [0, 0, 0] and has no direction."));
  }
  return rigid;
}

/// A vertex belongs to one handle, and once.
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
      refuse("HANDLE_VERTEX_TWICE", absl::StrCat("vertex ", vertex),
             absl::StrCat("Vertex ", vertex, " is ", where, "; it belongs to one handle, once."));
    }
  }

 private:
  std::map<std::uint32_t, std::string> owner_;
};

/// Parses, and refuses a key that stands twice in one object: the library would silently keep the later one.
json parse_strictly(std::string_view text) {
  std::vector<std::set<std::string>> keys;
  const auto watch = [&keys](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second) {
      refuse("HANDLE_FILE_KEY", parsed.get<std::string>(),
             absl::StrCat("The key ", shown(parsed), " stands twice in one object."));
    }
    return true;
  };
  try {
    return json::parse(text, watch);
  } catch (const json::exception& error) {
    const std::string what = error.what();
    const std::size_t from = what.find("] ");
    refuse("HANDLE_FILE_SYNTAX", "",
           absl::StrCat("The handle file is not JSON: ", what.substr(from + 2), "."));
  }
}

std::vector<NamedHandle> handles_of(const json& file, std::int64_t vertex_count) {
  check_keys(file, "the handle file", {"mesh", "note", "handles", "groups"});
  const json& list = required(file, "the handle file", "handles");
  if (!list.is_array()) refuse_value("\"handles\"", "a list", list);
  if (list.empty())
    refuse("HANDLE_FILE_EMPTY", "", "The handle file has no handles; a deformation needs at least one.");
  std::vector<NamedHandle> handles;
  std::set<std::string> names;
  Owners owners;
  for (std::size_t index = 0; index < list.size(); ++index) {
    const json& object = list[index];
    const std::string name = name_of(object, "handles", index);
    const std::string owner = absl::StrCat("handle \"", name, "\"");
    if (!names.insert(name).second)
      refuse("HANDLE_NAME_TWICE", owner, absl::StrCat("There are two handles of the name \"", name, "\"."));
    check_keys(object, owner, {"name", "vertices", "translate", "rotate", "positions"});
    NamedHandle& handle = handles.emplace_back(NamedHandle{name, {}});
    handle.handle.vertices = vertices_of(object, owner, vertex_count);
    handle.handle.motion = motion_of(object, owner, handle.handle.vertices.size());
    owners.claim(handle);
  }
  return handles;
}

std::vector<VertexGroup> groups_of(const json& file, std::int64_t vertex_count) {
  std::vector<VertexGroup> groups;
  if (!file.is_object() || !file.contains("groups")) return groups;
  const json& list = file["groups"];
  if (!list.is_array()) refuse_value("\"groups\"", "a list", list);
  std::set<std::string> names;
  for (std::size_t index = 0; index < list.size(); ++index) {
    const json& object = list[index];
    const std::string name = name_of(object, "groups", index);
    const std::string owner = absl::StrCat("group \"", name, "\"");
    if (!names.insert(name).second)
      refuse("HANDLE_NAME_TWICE", owner, absl::StrCat("There are two groups of the name \"", name, "\"."));
    check_keys(object, owner, {"name", "vertices", "p", "stiffness"});
    VertexGroup& group = groups.emplace_back(VertexGroup{name, vertices_of(object, owner, vertex_count)});
    if (object.contains("p")) group.p = number(object["p"], key_of(owner, "p"));
    if (object.contains("stiffness"))
      group.stiffness = number(object["stiffness"], key_of(owner, "stiffness"));
  }
  return groups;
}

}  // namespace

absl::StatusOr<std::vector<VertexGroup>> parse_groups(std::string_view text, std::int64_t vertex_count) {
  try {
    return groups_of(parse_strictly(text), vertex_count);
  } catch (const Refusal& refusal) {
    return refusal.status;
  }
}

absl::StatusOr<std::vector<NamedHandle>> parse_handles(std::string_view text, std::int64_t vertex_count) {
  try {
    return handles_of(parse_strictly(text), vertex_count);
  } catch (const Refusal& refusal) {
    return refusal.status;
  }
}

absl::StatusOr<HandleFile> read_handle_file(const std::filesystem::path& path, std::int64_t vertex_count) {
  const absl::StatusOr<std::string> text = read_text(path);
  if (!text.ok()) return text.status();
  auto handles = parse_handles(*text, vertex_count);
  if (!handles.ok()) return handles.status();
  auto groups = parse_groups(*text, vertex_count);
  if (!groups.ok()) return groups.status();
  return HandleFile{*std::move(handles), *std::move(groups)};
}

std::string handle_file_text(const std::vector<NamedHandle>& handles, std::string_view mesh,
                             std::string_view note) {
  nlohmann::ordered_json file{{"mesh", mesh}, {"note", note}, {"handles", nlohmann::ordered_json::array()}};
  for (const NamedHandle& handle : handles) {
    nlohmann::ordered_json object{{"name", handle.name}, {"vertices", handle.handle.vertices}};
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
