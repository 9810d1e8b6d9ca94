#include "server/wire/parsed_size.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <cstdint>

namespace lpdeform {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;

/// Memory per field: its place in an object or in a list that grows by doubling, and the header of its text.
constexpr std::size_t kField = 64;
/// Memory per byte of packed numbers: one byte may become eight.
constexpr std::size_t kPackedNumber = 8;
/// The parser's limit of nesting.
constexpr int kDeepest = 100;

class Walk {
 public:
  explicit Walk(const InnerType& inner) : inner_(inner) {}

  std::size_t message(const Descriptor& type, std::string_view bytes, int depth) const {
    std::size_t sum = kField * (1 + static_cast<std::size_t>(type.field_count()) / 2);
    google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                              static_cast<int>(bytes.size()));
    while (const std::uint32_t tag = in.ReadTag()) {
      sum += kField;
      if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
        int size = 0;
        const bool is_whole = in.ReadVarintSizeAsInt(&size) && size >= 0;
        const auto at = static_cast<std::size_t>(in.CurrentPosition());
        if (!is_whole || !in.Skip(size)) return sum;  // the parser stops here, too
        sum += field(type, bytes, WireFormatLite::GetTagFieldNumber(tag),
                     bytes.substr(at, static_cast<std::size_t>(size)), depth);
      } else if (!skip_number(in, tag)) {
        return sum;
      }
    }
    return sum;
  }

 private:
  static bool skip_number(google::protobuf::io::CodedInputStream& in, std::uint32_t tag) {
    std::uint64_t number = 0;
    switch (WireFormatLite::GetTagWireType(tag)) {
      case WireFormatLite::WIRETYPE_VARINT:
        return in.ReadVarint64(&number);
      case WireFormatLite::WIRETYPE_FIXED64:
        return in.Skip(8);
      case WireFormatLite::WIRETYPE_FIXED32:
        return in.Skip(4);
      default:
        return true;  // a group: its fields are counted as fields of this message
    }
  }

  std::size_t field(const Descriptor& type, std::string_view message_bytes, int number,
                    std::string_view value, int depth) const {
    const FieldDescriptor* const field = type.FindFieldByNumber(number);
    if (field == nullptr || depth == kDeepest) return value.size();
    if (field->type() == FieldDescriptor::TYPE_MESSAGE)
      return message(*field->message_type(), value, depth + 1);
    if (field->is_packable()) return kPackedNumber * value.size();
    const bool may_be_message = field->type() == FieldDescriptor::TYPE_BYTES && inner_ != nullptr;
    const Descriptor* const inner = may_be_message ? inner_(type, message_bytes) : nullptr;
    return value.size() + (inner == nullptr ? 0 : message(*inner, value, depth + 1));
  }

  const InnerType& inner_;
};

}  // namespace

std::size_t parsed_size(const Descriptor& type, std::string_view bytes, const InnerType& inner) {
  return Walk(inner).message(type, bytes, 0);
}

}  // namespace lpdeform
