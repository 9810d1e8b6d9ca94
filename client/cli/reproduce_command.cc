#include "client/cli/reproduce_command.h"

#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <set>
#include <stop_token>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/files/core_motion.h"
#include "client/cli/files/handle_file.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/files/text_file.h"
#include "client/cli/interrupt.h"
#include "client/cli/progress.h"
#include "client/cli/reproduce/page.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/base/workers.h"
#include "core/io/whole_file.h"

namespace lpdeform::cli {
namespace {

namespace fs = std::filesystem;
using reproduce::Figure;

constexpr const char* kPage = "index.html";
constexpr const char* kVerdicts = "reproduce.json";

bool is_of_this_command(const fs::path& folder) {
  const absl::StatusOr<std::string> verdicts = read_text(folder / kVerdicts);
  return verdicts.ok() && verdicts->find(reproduce::kMadeBy) != std::string::npos;
}

/// Makes the folder if it does not exist. Called before long work, not after it.
absl::Status prepare_folder(const fs::path& folder, bool is_forced) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    return not_written(folder, "it is no folder");
  fs::create_directories(folder, error);
  if (error) return not_written(folder, error.message());
  if (access(folder.c_str(), W_OK | X_OK) != 0) return not_written(folder, std::strerror(errno));
  if (is_forced || fs::is_empty(folder, error) || is_of_this_command(folder)) return absl::OkStatus();
  return make_fault(
      {Reason::kOutNotOurs, folder.string(), "empty, or made by lpdeform reproduce"},
      absl::StrCat("\"", folder.string(),
                   "\" holds files that are not of lpdeform reproduce; --force writes beside and over "
                   "them."));
}

/// A name for files and headings that is not in `taken`.
std::string name_for(const fs::path& mesh, std::set<std::string>& taken) {
  std::string stem;
  for (const char character : mesh.stem().string()) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(character)) != 0;
    stem += is_plain ? character : '_';
  }
  std::string name = stem;
  for (int k = 2; !taken.insert(name).second; ++k) name = absl::StrCat(stem, "_", k);
  return name;
}

/// The paper's methods support only handles that hold vertices exactly.
absl::Status check_plain(const HandleFile& file) {
  const auto refused = [](const std::string& element) {
    return make_fault({Reason::kHandleFileValue, element, "handles that hold vertices exactly"},
                      absl::StrCat(element,
                                   " is not for the paper's methods, which know only handles that hold "
                                   "vertices exactly."));
  };
  for (const NamedHandle& named : file.handles) {
    const client::Handle& handle = named.handle;
    const bool is_plain = std::holds_alternative<client::Exactly>(handle.hold) && handle.points.empty() &&
                          handle.footprint == 0;
    if (!is_plain) return refused(absl::StrCat("handle \"", named.name, "\""));
  }
  return file.region.empty() ? absl::OkStatus() : refused("\"region\"");
}

absl::StatusOr<PaperPose> read_pose(const fs::path& mesh, const fs::path& handles, std::string name) {
  absl::StatusOr<AnyMeshFile> file = read_deformable(mesh);
  if (!file.ok()) return file.status();
  const absl::StatusOr<HandleFile> held = read_handles(handles, file->mesh.vertices.rows());
  if (!held.ok()) return held.status();
  if (absl::Status status = check_plain(*held); !status.ok()) return status;
  PaperPose pose{std::move(name), std::move(file->mesh), {}, ""};
  for (const NamedHandle& handle : held->handles) {
    std::vector<std::int32_t> vertices(handle.handle.vertices.begin(), handle.handle.vertices.end());
    const absl::Status set =
        pose.handles.set(handle.name, {std::move(vertices), to_core(handle.handle.motion)});
    if (!set.ok()) return set;
  }
  return pose;
}

absl::StatusOr<reproduce::Settings> read_settings(const ReproduceOptions& options) {
  if (options.meshes.size() != options.handles.size()) {
    return make_fault({Reason::kHandlesMissing, "--handles", "one --handles for each --mesh"},
                      absl::StrCat("There are ", options.meshes.size(), " --mesh and ",
                                   options.handles.size(), " --handles; each mesh needs its handle file."));
  }
  reproduce::Settings settings{options.size, options.threads > 0 ? options.threads : available_cores(), {}};
  std::set<std::string> taken{"sheet", "bar", "block", "creature", "arm"};
  for (std::size_t k = 0; k < options.meshes.size(); ++k) {
    absl::StatusOr<PaperPose> pose =
        read_pose(options.meshes[k], options.handles[k], name_for(options.meshes[k], taken));
    if (!pose.ok()) return pose.status();
    settings.others.push_back(*std::move(pose));
  }
  return settings;
}

absl::StatusOr<std::vector<Figure>> make_figures(const reproduce::Settings& settings, std::stop_token stop) {
  Progress progress;
  const reproduce::Watch watch{[&](const std::string& task, int done, int total) {
                                 progress.show(absl::StrFormat("%3d %%  %s", 90 * done / total, task));
                               },
                               stop};
  const absl::StatusOr<reproduce::Measurements> measured = measure(settings, watch);
  if (!measured.ok()) return measured.status();
  std::vector<Figure> figures = all_figures(*measured, [&](const std::string& title) {
    progress.show(absl::StrCat(" 90 %  drawing ", title));
    return !stop.stop_requested();
  });
  if (stop.stop_requested()) return absl::CancelledError();
  return figures;
}

/// Removes the pictures of an earlier page that this page does not have.
void remove_stale(const fs::path& folder, const std::vector<Figure>& figures) {
  const absl::StatusOr<std::string> before = read_text(folder / kVerdicts);
  std::set<std::string> stale;
  if (before.ok()) stale = reproduce::pictures_named(*before);
  for (const Figure& figure : figures) {
    for (const reproduce::Picture& picture : figure.pictures) stale.erase(picture.file);
  }
  std::error_code ignored;  // a file that cannot be removed does no harm
  for (const std::string& file : stale) fs::remove(folder / file, ignored);
}

/// Writes the verdicts last: they show that the folder is complete.
absl::Status write_all(const fs::path& folder, const std::vector<Figure>& figures,
                       const reproduce::Settings& settings) {
  for (const Figure& figure : figures) {
    for (const reproduce::Picture& picture : figure.pictures) {
      const absl::Status written = write_whole_file(folder / picture.file, picture.png);
      if (!written.ok()) return written;
    }
  }
  const absl::Status written = write_whole_file(folder / kPage, page_html(figures, settings));
  if (!written.ok()) return written;
  remove_stale(folder, figures);
  return write_whole_file(folder / kVerdicts, verdicts_json(figures, settings));
}

void print_summary(const fs::path& folder, const std::vector<Figure>& figures) {
  for (const Figure& figure : figures) {
    for (const reproduce::Claim& claim : figure.claims) {
      std::printf("%-14s %s  %s\n", figure.id.c_str(), claim.holds ? "holds         " : "does not hold ",
                  claim.measured.c_str());
    }
  }
  std::printf("wrote %s\n", (folder / kPage).c_str());
}

}  // namespace

ExitStatus run_reproduce(const ReproduceOptions& options) {
  Interrupt interrupt;
  const absl::StatusOr<reproduce::Settings> settings = read_settings(options);
  if (!settings.ok()) return complain(settings.status());
  const absl::Status folder = prepare_folder(options.out, options.is_forced);
  if (!folder.ok()) return complain(folder);

  std::stop_source stop;
  interrupt.set_action([&stop] { stop.request_stop(); });
  const absl::StatusOr<std::vector<Figure>> figures = make_figures(*settings, stop.get_token());
  interrupt.set_action({});
  if (interrupt.happened()) return kInterrupted;
  if (!figures.ok()) return complain(figures.status());

  const absl::Status written = write_all(options.out, *figures, *settings);
  if (!written.ok()) return complain(written);
  print_summary(options.out, *figures);
  return kDone;
}

}  // namespace lpdeform::cli
