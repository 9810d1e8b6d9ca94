#include "tests/fuzz/proto_mutator.h"

#include <array>
#include <limits>
#include <string>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace lpdeform::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr std::size_t kLongest = 4096;  // bytes of a text

std::size_t below(std::size_t count, std::mt19937& random) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

double some_double(double old, std::mt19937& random) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::array<double, 14> known{0,
                                     -0.0,
                                     1,
                                     2,
                                     1.5,
                                     6,
                                     -1,
                                     1e-300,
                                     1e300,
                                     1e-5,
                                     kInfinity,
                                     -kInfinity,
                                     std::numeric_limits<double>::quiet_NaN(),
                                     1e9};
  if (below(2, random) == 0) return old * std::uniform_real_distribution<>(-2, 2)(random) + 0.1;
  return known[below(known.size(), random)];
}

std::uint64_t some_integer(std::uint64_t old, std::mt19937& random) {
  const std::array<std::uint64_t, 10> known{0,  1,     2,          3,          7,
                                            64, 65536, 0x7fffffff, 0xffffffff, ~std::uint64_t{0}};
  if (below(2, random) == 0) return old + below(5, random) - 2;
  return known[below(known.size(), random)];
}

std::string some_text(std::string old, bool is_bytes, std::mt19937& random) {
  if (below(8, random) == 0) return "";
  const std::size_t size = old.size();
  old.resize(std::min(size + 64, std::max(kLongest, size)));
  old.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(old.data()), size, old.size()));
  if (!is_bytes) {
    for (char& letter : old) letter = static_cast<char>(letter & 0x7f);  // stays UTF-8
  }
  return old;
}

/// Calls set(value) with a new value of the field's kind, from `old` where it has one.
template <typename Get, typename Set>
void change_scalar(const FieldDescriptor& field, std::mt19937& random, const Get& get, const Set& set) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return set(some_double(get(0.0), random));
    case FieldDescriptor::CPPTYPE_STRING:
      return set(some_text(get(std::string()), field.type() == FieldDescriptor::TYPE_BYTES, random));
    case FieldDescriptor::CPPTYPE_ENUM:
      return set(static_cast<std::uint64_t>(
          below(static_cast<std::size_t>(field.enum_type()->value_count()) + 1, random)));
    default:
      return set(some_integer(get(std::uint64_t{0}), random));
  }
}

struct Value {
  const Message& message;
  const FieldDescriptor& field;
  int index;  // -1: not repeated

  double operator()(double) const {
    const Reflection& r = *message.GetReflection();
    const bool is_double = field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
    if (index >= 0)
      return is_double ? r.GetRepeatedDouble(message, &field, index)
                       : r.GetRepeatedFloat(message, &field, index);
    return is_double ? r.GetDouble(message, &field) : r.GetFloat(message, &field);
  }
  std::string operator()(const std::string&) const {
    const Reflection& r = *message.GetReflection();
    return index >= 0 ? r.GetRepeatedString(message, &field, index) : r.GetString(message, &field);
  }
  std::uint64_t operator()(std::uint64_t) const {
    const Reflection& r = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_UINT32:
        return index >= 0 ? r.GetRepeatedUInt32(message, &field, index) : r.GetUInt32(message, &field);
      case FieldDescriptor::CPPTYPE_UINT64:
        return index >= 0 ? r.GetRepeatedUInt64(message, &field, index) : r.GetUInt64(message, &field);
      default:
        return 0;
    }
  }
};

struct Setter {
  Message& message;
  const FieldDescriptor& field;
  int index;  // -1: not repeated; its size: one more

  void operator()(const std::string& value) const {
    const Reflection& r = *message.GetReflection();
    if (!field.is_repeated()) return r.SetString(&message, &field, value);
    if (index == r.FieldSize(message, &field)) return r.AddString(&message, &field, value);
    r.SetRepeatedString(&message, &field, index, value);
  }
  void operator()(double value) const { number(value, static_cast<std::int64_t>(0)); }
  void operator()(std::uint64_t value) const { number(0.0, static_cast<std::int64_t>(value)); }

 private:
  void number(double real, std::int64_t whole) const {
    const Reflection& r = *message.GetReflection();
    const auto put = [&](auto set, auto set_repeated, auto add, auto value) {
      if (!field.is_repeated()) return (r.*set)(&message, &field, value);
      if (index == r.FieldSize(message, &field)) return (r.*add)(&message, &field, value);
      (r.*set_repeated)(&message, &field, index, value);
    };
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return put(&Reflection::SetDouble, &Reflection::SetRepeatedDouble, &Reflection::AddDouble, real);
      case FieldDescriptor::CPPTYPE_FLOAT:
        return put(&Reflection::SetFloat, &Reflection::SetRepeatedFloat, &Reflection::AddFloat,
                   static_cast<float>(real));
      case FieldDescriptor::CPPTYPE_BOOL:
        return put(&Reflection::SetBool, &Reflection::SetRepeatedBool, &Reflection::AddBool,
                   (whole & 1) != 0);
      case FieldDescriptor::CPPTYPE_ENUM:
        return put(&Reflection::SetEnumValue, &Reflection::SetRepeatedEnumValue, &Reflection::AddEnumValue,
                   static_cast<int>(whole));
      case FieldDescriptor::CPPTYPE_INT32:
        return put(&Reflection::SetInt32, &Reflection::SetRepeatedInt32, &Reflection::AddInt32,
                   static_cast<std::int32_t>(whole));
      case FieldDescriptor::CPPTYPE_INT64:
        return put(&Reflection::SetInt64, &Reflection::SetRepeatedInt64, &Reflection::AddInt64, whole);
      case FieldDescriptor::CPPTYPE_UINT32:
        return put(&Reflection::SetUInt32, &Reflection::SetRepeatedUInt32, &Reflection::AddUInt32,
                   static_cast<std::uint32_t>(whole));
      case FieldDescriptor::CPPTYPE_UINT64:
        return put(&Reflection::SetUInt64, &Reflection::SetRepeatedUInt64, &Reflection::AddUInt64,
                   static_cast<std::uint64_t>(whole));
      default:
        return;
    }
  }
};

void mutate_repeated(Message& message, const FieldDescriptor& field, std::mt19937& random) {
  const Reflection& r = *message.GetReflection();
  const int size = r.FieldSize(message, &field);
  const bool is_message = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  const std::size_t what = below(6, random);
  if (size == 0 || what == 0) {
    if (is_message)
      mutate(*r.AddMessage(&message, &field), random);
    else
      change_scalar(
          field, random, [](auto none) { return none; }, Setter{message, field, size});
    return;
  }
  const int index = static_cast<int>(below(static_cast<std::size_t>(size), random));
  if (what == 1) {
    r.SwapElements(&message, &field, index, size - 1);
    r.RemoveLast(&message, &field);
    return;
  }
  if (what == 2) {
    r.SwapElements(&message, &field, index, static_cast<int>(below(static_cast<std::size_t>(size), random)));
    return;
  }
  if (what == 3 && is_message) {
    r.AddMessage(&message, &field)->CopyFrom(r.GetRepeatedMessage(message, &field, index));
    return;
  }
  if (!is_message) {
    change_scalar(field, random, Value{message, field, index}, Setter{message, field, index});
    return;
  }
  mutate(*r.MutableRepeatedMessage(&message, &field, index), random);
}

}  // namespace

void mutate(Message& message, std::mt19937& random) {
  const auto& descriptor = *message.GetDescriptor();
  if (descriptor.field_count() == 0) return;
  const Reflection& r = *message.GetReflection();
  // What is there already is changed more often than what is not.
  std::vector<const FieldDescriptor*> fields;
  r.ListFields(message, &fields);
  const bool takes_present = !fields.empty() && below(3, random) != 0;
  const FieldDescriptor& field = takes_present
                                     ? *fields[below(fields.size(), random)]
                                     : *descriptor.field(static_cast<int>(below(
                                           static_cast<std::size_t>(descriptor.field_count()), random)));
  if (field.is_repeated()) return mutate_repeated(message, field, random);
  if (takes_present && below(12, random) == 0) return r.ClearField(&message, &field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
    return mutate(*r.MutableMessage(&message, &field), random);
  change_scalar(field, random, Value{message, field, -1}, Setter{message, field, -1});
}

}  // namespace lpdeform::fuzz
