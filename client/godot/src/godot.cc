#include "godot.h"

#include <cstring>
#include <deque>

namespace godot {
namespace {

GDExtensionClassLibraryPtr extension;
GDExtensionInterfaceGetProcAddress find_function;

// Godot's functions, under the names and types that its header gives them.
GDExtensionInterfacePrintErrorWithMessage print_error;
GDExtensionInterfaceClassdbRegisterExtensionClass5 register_class;
GDExtensionInterfaceClassdbRegisterExtensionClassMethod register_method;
GDExtensionInterfaceClassdbUnregisterExtensionClass unregister_class;
GDExtensionInterfaceClassdbConstructObject2 construct_object;
GDExtensionInterfaceObjectSetInstance set_instance;
GDExtensionInterfaceStringNameNewWithLatin1Chars new_name;
GDExtensionInterfaceStringNewWithUtf8Chars new_string;
GDExtensionInterfaceStringToUtf8Chars string_to_utf8;
GDExtensionInterfaceVariantConstruct construct_variant;
GDExtensionInterfaceVariantDestroy destroy_variant;
GDExtensionInterfaceVariantGetType type_of;
GDExtensionInterfaceGetVariantGetInternalPtrFunc get_inside;
GDExtensionInterfaceVariantGetPtrBuiltinMethod get_builtin_method;
GDExtensionInterfaceVariantGetPtrDestructor get_destructor;
GDExtensionInterfacePackedInt32ArrayOperatorIndexConst number_at;
GDExtensionInterfacePackedVector3ArrayOperatorIndex vector_at;
GDExtensionInterfacePackedVector3ArrayOperatorIndexConst const_vector_at;
GDExtensionInterfacePackedColorArrayOperatorIndex colour_at;

template <typename Function>
bool find(Function& function, const char* name) {
  function = reinterpret_cast<Function>(find_function(name));
  if (function != nullptr) return true;
  if (print_error != nullptr)
    print_error("lpdeform needs Godot 4.5 or newer", name, "load", "lpdeform", 0, 1);
  return false;
}

/// Godot's text of constant names. Of the size of a pointer.
class Name {
 public:
  explicit Name(const char* text) { new_name(&opaque_, text, 0); }
  ~Name() { get_destructor(GDEXTENSION_VARIANT_TYPE_STRING_NAME)(&opaque_); }
  Name(const Name&) = delete;
  Name& operator=(const Name&) = delete;
  void* get() { return &opaque_; }

 private:
  void* opaque_ = nullptr;
};

class String {
 public:
  explicit String(const char* text) { new_string(&opaque_, text); }
  ~String() { get_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(&opaque_); }
  String(const String&) = delete;
  String& operator=(const String&) = delete;
  void* get() { return &opaque_; }

 private:
  void* opaque_ = nullptr;
};

/// A method of packed arrays. All of them have it under the same number of its signature.
GDExtensionPtrBuiltInMethod array_method(GDExtensionVariantType type, const char* name,
                                         GDExtensionInt signature) {
  Name of(name);
  return get_builtin_method(type, of.get(), signature);
}

std::size_t size(GDExtensionVariantType type, GDExtensionConstTypePtr array) {
  std::int64_t count = 0;
  array_method(type, "size", 3173160232)(const_cast<void*>(array), nullptr, &count, 0);
  return static_cast<std::size_t>(count);
}

void resize(GDExtensionVariantType type, GDExtensionTypePtr array, std::size_t count) {
  std::int64_t to = static_cast<std::int64_t>(count), error = 0;
  const GDExtensionConstTypePtr arguments[] = {&to};
  array_method(type, "resize", 848867239)(array, arguments, &error, 1);
}

/// A Variant with a value of a type of its own.
class Variant {
 public:
  explicit Variant(GDExtensionVariantType type) { is_made_ = make(type, nullptr, 0); }
  /// Converted, as Godot converts. inside() is nullptr if it cannot be.
  Variant(GDExtensionVariantType type, GDExtensionConstVariantPtr from) { is_made_ = make(type, &from, 1); }
  ~Variant() {
    if (is_made_) destroy_variant(opaque_);
  }
  Variant(const Variant&) = delete;
  Variant& operator=(const Variant&) = delete;
  void* get() { return opaque_; }
  void* inside() { return is_made_ ? get_inside(type_of(opaque_))(opaque_) : nullptr; }

 private:
  bool make(GDExtensionVariantType type, const GDExtensionConstVariantPtr* from, int count) {
    GDExtensionCallError error{};
    construct_variant(type, opaque_, from, count, &error);
    return error.error == GDEXTENSION_CALL_OK;
  }

  alignas(8) unsigned char opaque_[24];
  bool is_made_ = false;
};

/// A call by Variants, as scripts without types make it.
void call_with_variants(void* method_pointer, GDExtensionClassInstancePtr object,
                        const GDExtensionConstVariantPtr* variants, GDExtensionInt count,
                        GDExtensionVariantPtr result, GDExtensionCallError* error) {
  const Method& method = *static_cast<const Method*>(method_pointer);
  const auto expected = static_cast<GDExtensionInt>(method.types.size());
  if (count != expected) {
    error->error = count < expected ? GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS
                                    : GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS;
    error->expected = static_cast<std::int32_t>(expected);
    return;
  }
  std::vector<GDExtensionConstTypePtr> arguments;
  std::deque<Variant> converted;  // where none moves
  for (std::size_t k = 0; k < method.types.size(); ++k) {
    arguments.push_back(converted.emplace_back(method.types[k], variants[k]).inside());
    if (arguments.back() != nullptr) continue;
    *error = {GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT, static_cast<std::int32_t>(k), method.types[k]};
    return;
  }
  Variant value(method.result);
  method.call(object, arguments.data(), value.inside());
  // `result` is an empty Variant, which owns nothing.
  const GDExtensionConstVariantPtr from = value.get();
  construct_variant(method.result, result, &from, 1, error);
}

void call_with_types(void* method, GDExtensionClassInstancePtr object,
                     const GDExtensionConstTypePtr* arguments, GDExtensionTypePtr result) {
  static_cast<const Method*>(method)->call(object, arguments, result);
}

struct Class {
  Class(const char* its_name, void* (*its_make)(), void (*its_remove)(void*))
      : name(its_name), make(its_make), remove(its_remove) {}
  Name name;
  void* (*make)();
  void (*remove)(void*);
};

void add_method(Class& of, const Method& method) {
  Name name(method.name), no_class("");
  String no_hint("");
  std::deque<Name> names;
  std::vector<GDExtensionPropertyInfo> arguments;
  for (std::size_t k = 0; k < method.types.size(); ++k)
    arguments.push_back(
        {method.types[k], names.emplace_back(method.names[k]).get(), no_class.get(), 0, no_hint.get(), 6});
  std::vector<GDExtensionClassMethodArgumentMetadata> metadata(arguments.size(),
                                                               GDEXTENSION_METHOD_ARGUMENT_METADATA_NONE);
  GDExtensionPropertyInfo result{method.result, no_class.get(), no_class.get(), 0, no_hint.get(), 6};
  GDExtensionClassMethodInfo info{};
  info.name = name.get();
  info.method_userdata = const_cast<Method*>(&method);
  info.call_func = call_with_variants;
  info.ptrcall_func = call_with_types;
  info.method_flags = GDEXTENSION_METHOD_FLAGS_DEFAULT;
  info.has_return_value = 1;
  info.return_value_info = &result;
  info.argument_count = static_cast<std::uint32_t>(arguments.size());
  info.arguments_info = arguments.data();
  info.arguments_metadata = metadata.data();
  register_method(extension, of.name.get(), &info);
}

}  // namespace

bool load(GDExtensionInterfaceGetProcAddress get_proc_address, GDExtensionClassLibraryPtr library) {
  find_function = get_proc_address;
  extension = library;
  return find(print_error, "print_error_with_message") &&
         find(register_class, "classdb_register_extension_class5") &&
         find(register_method, "classdb_register_extension_class_method") &&
         find(unregister_class, "classdb_unregister_extension_class") &&
         find(construct_object, "classdb_construct_object2") && find(set_instance, "object_set_instance") &&
         find(new_name, "string_name_new_with_latin1_chars") &&
         find(new_string, "string_new_with_utf8_chars") && find(string_to_utf8, "string_to_utf8_chars") &&
         find(construct_variant, "variant_construct") && find(destroy_variant, "variant_destroy") &&
         find(type_of, "variant_get_type") && find(get_inside, "variant_get_ptr_internal_getter") &&
         find(get_builtin_method, "variant_get_ptr_builtin_method") &&
         find(get_destructor, "variant_get_ptr_destructor") &&
         find(number_at, "packed_int32_array_operator_index_const") &&
         find(vector_at, "packed_vector3_array_operator_index") &&
         find(const_vector_at, "packed_vector3_array_operator_index_const") &&
         find(colour_at, "packed_color_array_operator_index");
}

bool Passed<bool>::read(GDExtensionConstTypePtr from) {
  return *static_cast<const GDExtensionBool*>(from) != 0;
}
void Passed<bool>::write(const bool& value, GDExtensionTypePtr to) {
  *static_cast<GDExtensionBool*>(to) = value ? 1 : 0;
}

std::int64_t Passed<std::int64_t>::read(GDExtensionConstTypePtr from) {
  return *static_cast<const std::int64_t*>(from);
}
void Passed<std::int64_t>::write(const std::int64_t& value, GDExtensionTypePtr to) {
  *static_cast<std::int64_t*>(to) = value;
}

double Passed<double>::read(GDExtensionConstTypePtr from) {
  return *static_cast<const double*>(from);
}
void Passed<double>::write(const double& value, GDExtensionTypePtr to) {
  *static_cast<double*>(to) = value;
}

std::string Passed<std::string>::read(GDExtensionConstTypePtr from) {
  std::string text(static_cast<std::size_t>(string_to_utf8(from, nullptr, 0)), '\0');
  string_to_utf8(from, text.data(), static_cast<GDExtensionInt>(text.size()));
  return text;
}
void Passed<std::string>::write(const std::string& value, GDExtensionTypePtr to) {
  get_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(to);
  new_string(to, value.c_str());
}

Vector3 Passed<Vector3>::read(GDExtensionConstTypePtr from) {
  return *static_cast<const Vector3*>(from);
}
void Passed<Vector3>::write(const Vector3& value, GDExtensionTypePtr to) {
  *static_cast<Vector3*>(to) = value;
}

Quaternion Passed<Quaternion>::read(GDExtensionConstTypePtr from) {
  return *static_cast<const Quaternion*>(from);
}
void Passed<Quaternion>::write(const Quaternion& value, GDExtensionTypePtr to) {
  *static_cast<Quaternion*>(to) = value;
}

Numbers Passed<Numbers>::read(GDExtensionConstTypePtr from) {
  Numbers numbers(size(kType, from));
  if (!numbers.empty())
    std::memcpy(numbers.data(), number_at(from, 0), numbers.size() * sizeof(std::uint32_t));
  return numbers;
}

Vectors Passed<Vectors>::read(GDExtensionConstTypePtr from) {
  Vectors vectors;
  vectors.resize(3 * size(kType, from));
  if (!vectors.empty()) std::memcpy(vectors.data(), const_vector_at(from, 0), vectors.size() * sizeof(float));
  return vectors;
}
void Passed<Vectors>::write(const Vectors& value, GDExtensionTypePtr to) {
  resize(kType, to, value.size() / 3);
  if (!value.empty()) std::memcpy(vector_at(to, 0), value.data(), value.size() * sizeof(float));
}

void Passed<Colours>::write(const Colours& value, GDExtensionTypePtr to) {
  resize(kType, to, value.size() / 4);
  if (value.empty()) return;
  float* const channels = static_cast<float*>(colour_at(to, 0));
  for (std::size_t k = 0; k < value.size(); ++k) channels[k] = static_cast<float>(value[k]) / 255;
}

void add_class(const char* name, void* (*make)(), void (*remove)(void* object),
               const std::vector<Method>& methods) {
  Class* const made = new Class(name, make, remove);  // until the process ends, as the methods
  Name parent("RefCounted");
  GDExtensionClassCreationInfo5 info{};
  info.is_exposed = 1;
  info.class_userdata = made;
  info.create_instance_func = [](void* userdata, GDExtensionBool) {
    Class& of = *static_cast<Class*>(userdata);
    Name base("RefCounted");
    const GDExtensionObjectPtr object = construct_object(base.get());
    set_instance(object, of.name.get(), of.make());
    return object;
  };
  info.free_instance_func = [](void* userdata, GDExtensionClassInstancePtr object) {
    static_cast<Class*>(userdata)->remove(object);
  };
  register_class(extension, made->name.get(), parent.get(), &info);
  for (const Method& method : methods) add_method(*made, method);
}

void remove_class(const char* name) {
  Name of(name);
  unregister_class(extension, of.get());
}

}  // namespace godot
