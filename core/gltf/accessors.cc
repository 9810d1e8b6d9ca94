#include "core/gltf/accessors.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/io/byte_order.h"

namespace lpdeform::gltf {
namespace {

/// A componentType.
struct Component {
  int size = 0;
  double most = 0;  // what 1 is stored as if normalized
  double (*load)(const char*) = nullptr;
};

template <typename Number>
Component component() {
  return {sizeof(Number), static_cast<double>(std::numeric_limits<Number>::max()),
          [](const char* bytes) { return static_cast<double>(load_little_endian<Number>(bytes)); }};
}

Component component_of(const Json& object, const std::string& part) {
  switch (whole(object, "componentType", 0, part)) {
    case 5120:
      return component<std::int8_t>();
    case 5121:
      return component<std::uint8_t>();
    case 5122:
      return component<std::int16_t>();
    case 5123:
      return component<std::uint16_t>();
    case 5125:
      return component<std::uint32_t>();
    case kFloat:
      return component<float>();
    default:
      refuse(part, "has an unknown \"componentType\"");
  }
}

std::string_view type_name(int columns) {
  return columns == 1 ? "SCALAR" : columns == 3 ? "VEC3" : columns == 4 ? "VEC4" : "MAT4";
}

std::optional<int> columns_of(const Json& object) {
  const Json* const type = value_of(object, "type");
  if (type == nullptr || !type->is_string()) return std::nullopt;
  for (const auto& [name, columns] : {std::pair("SCALAR", 1),
                                      {"VEC2", 2},
                                      {"VEC3", 3},
                                      {"VEC4", 4},
                                      {"MAT2", 4},
                                      {"MAT3", 9},
                                      {"MAT4", 16}}) {
    if (type->get_ref<const std::string&>() == name) return columns;
  }
  return std::nullopt;
}

/// The layout of elements in a bufferView, as an accessor or a part of "sparse" names it.
Layout layout_in_view(const Document& document, const Json& owner, std::uint64_t count, std::uint64_t size,
                      const std::string& part) {
  const Json& root = document.root;
  const std::size_t number = needed_index(root, owner, "bufferView", "bufferViews", part);
  const Json& view = item(root, "bufferViews", number);
  const std::string name = part_name(root, "bufferViews", number);
  const std::size_t buffer = needed_index(root, view, "buffer", "buffers", name);
  const std::uint64_t begin = whole(view, "byteOffset", 0, name), length = whole(view, "byteLength", 0, name);
  const std::uint64_t stride = whole(view, "byteStride", size, name),
                      offset = whole(owner, "byteOffset", 0, part);
  const std::uint64_t held = document.buffers[buffer].size();
  if (begin > held || length > held - begin)
    refuse(name, absl::StrCat("reaches to byte ", begin + length, " of ", part_name(root, "buffers", buffer),
                              ", which has ", held));
  if (stride < size || stride > 252 + size)
    refuse(name, absl::StrCat("has a \"byteStride\" of ", stride, " for elements of ", size, " bytes"));
  const Layout layout{buffer, begin + offset, stride, size, count};
  if (layout.end() > begin + length)
    refuse(part, absl::StrCat("reaches beyond the ", length, " bytes of ", name));
  return layout;
}

void fill(const Document& document, const Layout& layout, const Component& component, int columns,
          Table& table, const std::vector<std::uint32_t>* rows) {
  const char* const bytes = document.buffers[layout.buffer].data() + layout.begin;
  for (std::uint64_t k = 0; k < layout.count; ++k) {
    const auto row = static_cast<Eigen::Index>(rows != nullptr ? (*rows)[k] : k);
    for (int column = 0; column < columns; ++column)
      table(row, column) =
          component.load(bytes + k * layout.stride + static_cast<std::uint64_t>(column * component.size));
  }
}

std::vector<std::uint32_t> sparse_rows(const Document& document, const Json& sparse, std::uint64_t count,
                                       std::uint64_t most, const std::string& part) {
  const Json* const indices = value_of(sparse, "indices");
  if (indices == nullptr) refuse(part, "has no \"indices\"");
  const Component component = component_of(*indices, part);
  const Layout layout =
      layout_in_view(document, *indices, count, static_cast<std::uint64_t>(component.size), part);
  std::vector<std::uint32_t> rows(count);
  for (std::uint64_t k = 0; k < count; ++k) {
    const double row =
        component.load(document.buffers[layout.buffer].data() + layout.begin + k * layout.stride);
    if (!(row >= 0 && row < static_cast<double>(most)))
      refuse(part, absl::StrCat("names element ", row, " of ", most));
    rows[k] = static_cast<std::uint32_t>(row);
  }
  if (std::ranges::adjacent_find(rows, std::ranges::greater_equal{}) != rows.end())
    refuse(part, "has \"indices\" that do not rise");
  return rows;
}

void put_sparse(const Document& document, const Json& sparse, const Component& component, int columns,
                const std::string& owner, Table& table) {
  const std::string part = absl::StrCat("\"sparse\" of ", owner);
  const auto most = static_cast<std::uint64_t>(table.rows());
  const std::uint64_t count = whole(sparse, "count", 0, part);
  if (count > most) refuse(part, absl::StrCat("has ", count, " values for ", most, " elements"));
  const Json* const values = value_of(sparse, "values");
  if (values == nullptr) refuse(part, "has no \"values\"");
  const Layout layout =
      layout_in_view(document, *values, count, static_cast<std::uint64_t>(component.size * columns), part);
  const std::vector<std::uint32_t> rows = sparse_rows(document, sparse, count, most, part);
  fill(document, layout, component, columns, table, &rows);
}

void scale_normalized(const Component& component, const Json& object, const std::string& part, Table& table) {
  const Json* const is_normalized = value_of(object, "normalized");
  if (is_normalized == nullptr || *is_normalized != true) return;
  if (component.size == 4) refuse(part, "is normalized, and has no small integers");
  table = (table / component.most).cwiseMax(-1);
}

}  // namespace

std::uint64_t element_count(const Json& root, std::size_t accessor) {
  const std::string part = part_name(root, "accessors", accessor);
  const std::uint64_t count = whole(item(root, "accessors", accessor), "count", 0, part);
  if (count > kMostElements)
    refuse_unsupported(part, absl::StrCat("has ", count, " elements; at most ", kMostElements, " are read"));
  return count;
}

Layout layout_of(const Document& document, std::size_t accessor) {
  const Json& object = item(document.root, "accessors", accessor);
  const std::string part = part_name(document.root, "accessors", accessor);
  const Component component = component_of(object, part);
  const auto columns = columns_of(object);
  if (!columns) refuse(part, "has an unknown \"type\"");
  return layout_in_view(document, object, element_count(document.root, accessor),
                        static_cast<std::uint64_t>(component.size * *columns), part);
}

Table read_table(const Document& document, std::size_t accessor, int columns) {
  const Json& object = item(document.root, "accessors", accessor);
  const std::string part = part_name(document.root, "accessors", accessor);
  if (columns_of(object) != columns)
    refuse(part, absl::StrCat("must be of type ", std::string(type_name(columns))));
  const Component component = component_of(object, part);
  const Layout layout = layout_of(document, accessor);
  Table table(static_cast<Eigen::Index>(layout.count), columns);
  fill(document, layout, component, columns, table, nullptr);
  if (const Json* const sparse = value_of(object, "sparse"))
    put_sparse(document, *sparse, component, columns, part, table);
  scale_normalized(component, object, part, table);
  return table;
}

std::vector<std::uint32_t> read_indices(const Document& document, std::size_t accessor) {
  const Json& object = item(document.root, "accessors", accessor);
  const std::string part = part_name(document.root, "accessors", accessor);
  const std::uint64_t type = whole(object, "componentType", 0, part);
  if (type != 5121 && type != 5123 && type != 5125)
    refuse(part, "holds indices and has no unsigned integers");
  const Table table = read_table(document, accessor, 1);
  std::vector<std::uint32_t> indices(static_cast<std::size_t>(table.rows()));
  std::ranges::transform(table.reshaped(), indices.begin(),
                         [](double value) { return static_cast<std::uint32_t>(value); });
  return indices;
}

}  // namespace lpdeform::gltf
