#include "server/wire/frame_slices.h"

#include <google/protobuf/io/coded_stream.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace lpdeform {
namespace {

using google::protobuf::io::CodedOutputStream;

std::uint32_t tag_of(int field) {
  constexpr std::uint32_t kLengthDelimited = 2;
  return static_cast<std::uint32_t>(field) << 3 | kLengthDelimited;
}

/// Size of tag and length.
std::size_t head_size(int field, std::size_t size) {
  return CodedOutputStream::VarintSize32(tag_of(field)) + CodedOutputStream::VarintSize64(size);
}

void append_head(int field, std::size_t size, std::string& out) {
  std::uint8_t head[16];
  std::uint8_t* end = CodedOutputStream::WriteVarint32ToArray(tag_of(field), head);
  end = CodedOutputStream::WriteVarint64ToArray(size, end);
  out.append(reinterpret_cast<const char*>(head), static_cast<std::size_t>(end - head));
}

/// Size of the field; 0 if it is empty, because an empty field is omitted.
std::size_t field_size(int field, std::size_t size) {
  return size == 0 ? 0 : head_size(field, size) + size;
}

/// The last fields of a part, in order.
struct Numbers {
  int padding_field, field;
  std::string_view bytes;
  std::size_t padding = 0;

  std::size_t size() const { return field_size(padding_field, padding) + field_size(field, bytes.size()); }
};

std::vector<Numbers> numbers_of(const FramePiece& piece) {
  const Surface::Bytes bytes = piece.bytes();
  return {
      {v1::FramePart::kPositionsPaddingFieldNumber, v1::FramePart::kPositionsFieldNumber, bytes.positions},
      {v1::FramePart::kDistortionPaddingFieldNumber, v1::FramePart::kDistortionFieldNumber, bytes.distortion},
      {v1::FramePart::kNormalsPaddingFieldNumber, v1::FramePart::kNormalsFieldNumber, bytes.normals}};
}

std::size_t size_of(const std::vector<Numbers>& all) {
  std::size_t sum = 0;
  for (const Numbers& numbers : all) sum += numbers.size();
  return sum;
}

/// The lengths of the fields around the part and of the part itself, if each has `more` bytes in addition.
std::vector<std::size_t> lengths_with(const PartInMessage& part, std::size_t more) {
  std::vector<std::size_t> lengths(part.path.size());
  std::size_t growth = more;
  for (std::size_t k = part.path.size(); k-- > 0;) {
    const auto [number, size] = part.path[k];
    lengths[k] = size + growth;
    growth += head_size(number, lengths[k]) - head_size(number, size);
  }
  return lengths;
}

/// Size of everything before the numbers.
std::size_t size_before(const PartInMessage& part, const std::vector<std::size_t>& lengths) {
  std::size_t size = part.message.ByteSizeLong();
  for (std::size_t k = 0; k < part.path.size(); ++k) {
    const auto [number, length] = part.path[k];
    size += head_size(number, lengths[k]) - head_size(number, length);
  }
  return size;
}

/// Chooses the paddings. Each padding counts in the lengths before it, and these may become longer
/// themselves.
std::vector<Numbers> aligned(const PartInMessage& part, const FramePiece& piece) {
  const std::size_t unit = piece.format == Format::kFloat64 ? 8 : 4;
  std::vector<Numbers> all = numbers_of(piece);
  const auto begins_well = [&](std::size_t before, const Numbers& numbers) {
    const std::size_t head = head_size(numbers.field, numbers.bytes.size());
    return (before + field_size(numbers.padding_field, numbers.padding) + head) % unit == 0;
  };
  std::size_t after_first = all[0].bytes.size();  // the first field gets its own padding below
  for (std::size_t k = 1; k < all.size(); ++k) {
    if (all[k].bytes.empty()) continue;
    while (!begins_well(after_first, all[k])) ++all[k].padding;
    after_first += all[k].size();
  }
  for (all[0].padding = 0; all[0].padding < 4 * unit; ++all[0].padding) {
    if (begins_well(size_before(part, lengths_with(part, size_of(all))), all[0])) break;
  }
  return all;
}

/// A slice of the bytes of `surface`. It keeps the surface alive.
grpc::Slice slice_of(std::shared_ptr<const Surface> surface, std::string_view bytes) {
  const auto release = [](void* held) { delete static_cast<std::shared_ptr<const Surface>*>(held); };
  return {const_cast<char*>(bytes.data()), bytes.size(), release,
          new std::shared_ptr<const Surface>(std::move(surface))};
}

}  // namespace

std::size_t size_with(const PartInMessage& part, const FramePiece& piece) {
  const std::vector<Numbers> all = aligned(part, piece);
  return size_before(part, lengths_with(part, size_of(all))) + size_of(all);
}

std::vector<grpc::Slice> slices_with(const PartInMessage& part, const FramePiece& piece) {
  const std::vector<Numbers> all = aligned(part, piece);
  const std::vector<std::size_t> lengths = lengths_with(part, size_of(all));
  const std::string without = part.message.SerializeAsString();
  const std::size_t outer =
      without.size() - head_size(part.path[0].number, part.path[0].size) - part.path[0].size;
  std::string text = without.substr(0, outer);
  for (std::size_t k = 0; k < part.path.size(); ++k) append_head(part.path[k].number, lengths[k], text);
  text.append(without, without.size() - part.path.back().size);
  std::vector<grpc::Slice> slices;
  for (const Numbers& numbers : all) {
    if (numbers.padding > 0) {
      append_head(numbers.padding_field, numbers.padding, text);
      text.append(numbers.padding, '\0');
    }
    if (numbers.bytes.empty()) continue;
    append_head(numbers.field, numbers.bytes.size(), text);
    slices.emplace_back(std::exchange(text, {}));
    slices.push_back(slice_of(piece.frame->surface, numbers.bytes));
  }
  if (!text.empty()) slices.emplace_back(text);
  return slices;
}

}  // namespace lpdeform
