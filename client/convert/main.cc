// lpdeform-convert FILE OUT.glb: an FBX, COLLADA (DAE) or 3MF file as a GLB, which every other program here reads.
//
// The readers are those of assimp, in a process of their own: whatever a damaged file does to them is one sentence, and nothing is
// written then.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <numbers>
#include <string>
#include <string_view>

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "absl/strings/str_cat.h"
#include "core/gltf/gltf.h"
#include "core/io/mesh_io.h"
#include "core/io/whole_file.h"

namespace {

constexpr int kBadInput = 2;
constexpr rlim_t kMostMemoryBytes = rlim_t{8} << 30, kMostSeconds = 300;
constexpr std::array<std::string_view, 3> kEndings{".fbx", ".dae", ".3mf"};

int refuse(const std::string& text, std::FILE* to = stderr) {
  std::fprintf(to, "lpdeform-convert: %s\n", text.c_str());
  return kBadInput;
}

/// What the reader says, which may quote the file, as a part of a sentence.
std::string one_line(std::string text) {
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto code = static_cast<unsigned char>(text[k]);
    const bool is_c1 = k > 0 && text[k - 1] == '\xc2' && code >= 0x80 && code < 0xa0;  // in UTF-8
    if (is_c1) text[k - 1] = ' ';
    if (is_c1 || code < 0x20 || code == 0x7f) text[k] = ' ';
  }
  text.erase(text.find_last_not_of(". ") + 1);
  return text;
}

/// A texture is a file of its own; the GLB would name it.
void drop_textures(const aiScene& scene) {
  for (unsigned m = 0; m < scene.mNumMaterials; ++m) {
    aiMaterial& material = *scene.mMaterials[m];
    for (unsigned k = material.mNumProperties; k-- > 0;) {
      const aiMaterialProperty& property = *material.mProperties[k];
      if (std::strncmp(property.mKey.C_Str(), "$tex", 4) == 0)
        material.RemoveProperty(property.mKey.C_Str(), property.mSemantic, property.mIndex);
    }
  }
}

/// 3MF has z up, and glTF y; for the other formats assimp sees to it.
void turn_up(const aiScene& scene) {
  aiMatrix4x4 turn;
  aiMatrix4x4::RotationX(-std::numbers::pi_v<ai_real> / 2, turn);
  scene.mRootNode->mTransformation = turn * scene.mRootNode->mTransformation;
}

/// Returns if there is a refusal.
int convert(const std::filesystem::path& from, const std::filesystem::path& to, std::FILE* say) {
  const auto bytes = lpdeform::read_whole_file(from);
  if (!bytes.ok()) return refuse(std::string(bytes.status().message()), say);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_ANIMATIONS | aiComponent_TEXTURES |
                                                          aiComponent_LIGHTS | aiComponent_CAMERAS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_RemoveComponent |
                         aiProcess_ValidateDataStructure;  // the exporter joins vertices
  const aiScene* const scene = importer.ReadFileFromMemory(bytes->data(), bytes->size(), steps,
                                                           lpdeform::ending_of(from).substr(1).c_str());
  const auto unreadable = [&](std::string_view why) {
    return refuse(absl::StrCat(from.string(), " cannot be read: ", std::string(why)), say);
  };
  if (scene == nullptr) return unreadable(absl::StrCat(one_line(importer.GetErrorString()), "."));
  if (scene->mNumMeshes == 0) return unreadable("it has no triangles.");
  drop_textures(*scene);
  if (lpdeform::ending_of(from) == ".3mf") turn_up(*scene);
  Assimp::Exporter exporter;
  const aiExportDataBlob* const blob = exporter.ExportToBlob(scene, "glb2");
  if (blob == nullptr) return unreadable(absl::StrCat(one_line(exporter.GetErrorString()), "."));
  const std::string_view glb(static_cast<const char*>(blob->data), blob->size);
  const auto read = lpdeform::gltf::Gltf::parse(glb, {});
  if (!read.ok()) return unreadable(std::string(read.status().message()));
  const auto written = lpdeform::write_whole_file(to, glb);
  if (!written.ok()) return refuse(std::string(written.message()), say);
  std::printf("%s: %td vertices, %td faces\n", to.c_str(), read->mesh().vertices.rows(),
              read->mesh().faces.rows());
  std::fflush(nullptr);
  _exit(0);  // what the reader still does to end could fail, and the file is written
}

/// In the child. What the reader itself says on stderr is left out.
[[noreturn]] void convert_and_end(const std::filesystem::path& from, const std::filesystem::path& to) {
  const rlimit memory{kMostMemoryBytes, kMostMemoryBytes}, seconds{kMostSeconds, kMostSeconds}, core{0, 0};
  setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CPU, &seconds);
  setrlimit(RLIMIT_CORE, &core);
  std::FILE* const say = fdopen(dup(STDERR_FILENO), "w");
  int status = kBadInput;
  if (say == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr) _exit(status);
  try {
    status = convert(from, to, say);
  } catch (const std::bad_alloc&) {
    refuse(
        absl::StrCat(from.string(), " cannot be read: it needs more than ", kMostMemoryBytes >> 30, " GiB."),
        say);
  } catch (const std::exception& error) {
    refuse(absl::StrCat(from.string(), " cannot be read: ", one_line(error.what()), "."), say);
  }
  std::fflush(nullptr);
  _exit(status);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: lpdeform-convert FILE OUT.glb\nFILE: .fbx, .dae (COLLADA) or .3mf\n");
    return kBadInput;
  }
  const std::filesystem::path from = argv[1], to = argv[2];
  if (std::ranges::find(kEndings, lpdeform::ending_of(from)) == kEndings.end())
    return refuse(absl::StrCat("The name ", from.string(), " ends in none of .fbx, .dae and .3mf."));
  if (lpdeform::ending_of(to) != ".glb")
    return refuse(absl::StrCat("The name ", to.string(), " does not end in .glb."));
  const pid_t child = fork();
  if (child < 0) return refuse(absl::StrCat("There is no process for it: ", std::strerror(errno), "."));
  if (child == 0) convert_and_end(from, to);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  const bool is_too_much = WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL;
  return refuse(
      absl::StrCat(from.string(), " cannot be read: ",
                   is_too_much ? "it takes too long or too much memory."
                               : absl::StrCat("its reader has failed (", strsignal(WTERMSIG(status)), ").")));
}
