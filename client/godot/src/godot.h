#pragma once

#include <gdextension_interface.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// The part of Godot's extension interface that this extension uses. Floating-point numbers inside Godot's vectors are float: see
/// "single" in lpdeform.gdextension. All functions belong to the thread that calls the extension.
namespace godot {

/// Loads Godot's functions. False if this Godot is too old to have them all; Godot's output then names the first one.
bool load(GDExtensionInterfaceGetProcAddress get_proc_address, GDExtensionClassLibraryPtr library);

using Vector3 = std::array<float, 3>;
using Quaternion = std::array<float, 4>;  // x, y, z, w

/// x, y, z of each vector of a PackedVector3Array.
struct Vectors : std::vector<float> {};
/// Red, green, blue and alpha of each colour of a PackedColorArray, 0 to 255.
struct Colours : std::vector<std::uint8_t> {};
using Numbers = std::vector<std::uint32_t>;  // a PackedInt32Array; negative numbers become large

/// How a value passes the border: its type there, and how it is read from and written to the place where Godot has it. A place that is
/// written to has a value of that type already.
template <typename T>
struct Passed;

#define GODOT_PASSED(TYPE, VARIANT_TYPE)                                                     \
  template <>                                                                                \
  struct Passed<TYPE> {                                                                      \
    static constexpr GDExtensionVariantType kType = GDEXTENSION_VARIANT_TYPE_##VARIANT_TYPE; \
    static TYPE read(GDExtensionConstTypePtr from);                                          \
    static void write(const TYPE& value, GDExtensionTypePtr to);                             \
  };
GODOT_PASSED(bool, BOOL)
GODOT_PASSED(std::int64_t, INT)
GODOT_PASSED(double, FLOAT)
GODOT_PASSED(std::string, STRING)
GODOT_PASSED(Vector3, VECTOR3)
GODOT_PASSED(Quaternion, QUATERNION)
GODOT_PASSED(Numbers, PACKED_INT32_ARRAY)
GODOT_PASSED(Vectors, PACKED_VECTOR3_ARRAY)
GODOT_PASSED(Colours, PACKED_COLOR_ARRAY)
#undef GODOT_PASSED

/// A method of a class, for add_method. `call` reads the arguments and writes the result where Godot has them.
struct Method {
  const char* name;
  void (*call)(void* object, const GDExtensionConstTypePtr* arguments, GDExtensionTypePtr result);
  GDExtensionVariantType result;
  std::vector<GDExtensionVariantType> types;
  std::vector<const char*> names;  // of the arguments
};

template <auto kFunction>
struct MethodOf;

template <typename Class, typename Result, typename... Arguments, Result (Class::*kFunction)(Arguments...)>
struct MethodOf<kFunction> {
  template <std::size_t... kPlaces>
  static Result call(Class& object, const GDExtensionConstTypePtr* arguments,
                     std::index_sequence<kPlaces...>) {
    return (object.*kFunction)(Passed<std::decay_t<Arguments>>::read(arguments[kPlaces])...);
  }
  static Method named(const char* name, std::vector<const char*> arguments) {
    const auto passed = [](void* object, const GDExtensionConstTypePtr* from, GDExtensionTypePtr to) {
      Passed<Result>::write(call(*static_cast<Class*>(object), from, std::index_sequence_for<Arguments...>()),
                            to);
    };
    return {name,
            passed,
            Passed<Result>::kType,
            {Passed<std::decay_t<Arguments>>::kType...},
            std::move(arguments)};
  }
};

/// Registers a class that Godot's scripts can make and that is counted (RefCounted). `make` and `remove` are called with each object.
/// `methods` has to live as long as the class.
void add_class(const char* name, void* (*make)(), void (*remove)(void* object),
               const std::vector<Method>& methods);
void remove_class(const char* name);

}  // namespace godot
