// What Godot calls first: lpdeform.gdextension names lpdeform_godot_begin.
#include "godot.h"
#include "session.h"

namespace {

template <auto kFunction>
godot::Method method(const char* name, std::vector<const char*> arguments = {}) {
  return godot::MethodOf<kFunction>::named(name, std::move(arguments));
}

const std::vector<godot::Method>& session_methods() {
  static const std::vector<godot::Method> methods{
      method<&Session::open>("open", {"address", "token", "tls", "positions", "normals", "indices"}),
      method<&Session::hold>("hold", {"name", "vertices"}),
      method<&Session::let_go>("let_go", {"name"}),
      method<&Session::move>("move", {"name", "rotation", "translation"}),
      method<&Session::set_p>("set_p", {"p", "shows_better", "effort", "least_share"}),
      method<&Session::take_better_shape>("take_better_shape"),
      method<&Session::tick>("tick"),
      method<&Session::positions>("positions"),
      method<&Session::normals>("normals"),
      method<&Session::colours>("colours"),
      method<&Session::problem>("problem"),
      method<&Session::trouble>("trouble"),
      method<&Session::notice>("notice"),
      method<&Session::state>("state"),
      method<&Session::is_over>("is_over"),
  };
  return methods;
}

void begin(void*, GDExtensionInitializationLevel level) {
  if (level != GDEXTENSION_INITIALIZATION_SCENE) return;
  godot::add_class(
      "LpdeformSession", []() -> void* { return new Session; },
      [](void* object) { delete static_cast<Session*>(object); }, session_methods());
}

void end(void*, GDExtensionInitializationLevel level) {
  if (level == GDEXTENSION_INITIALIZATION_SCENE) godot::remove_class("LpdeformSession");
}

}  // namespace

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

extern "C" EXPORTED GDExtensionBool lpdeform_godot_begin(GDExtensionInterfaceGetProcAddress get_proc_address,
                                                         GDExtensionClassLibraryPtr library,
                                                         GDExtensionInitialization* initialization) {
  if (!godot::load(get_proc_address, library)) return 0;
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->initialize = begin;
  initialization->deinitialize = end;
  return 1;
}
