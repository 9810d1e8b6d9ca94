#include "client/cli/progress.h"

#include <unistd.h>

#include <cstdio>

#include "absl/strings/str_format.h"

namespace lpdeform::cli {
namespace {

constexpr const char* kClearLine = "\r\x1b[K";

}  // namespace

Progress::Progress() : is_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  clear();
}

void Progress::show(const std::string& what) {
  if (!is_terminal_) return;
  std::fprintf(stderr, "%s%s", kClearLine, what.c_str());
  is_shown_ = true;
}

void Progress::show(const client::SolveProgress& progress) {
  show(absl::StrFormat("iteration %d   E = %.6g   %.1f s", progress.iteration, progress.energy,
                       progress.seconds));
}

void Progress::clear() {
  if (is_shown_) std::fputs(kClearLine, stderr);
  is_shown_ = false;
}

}  // namespace lpdeform::cli
