#pragma once

#include <string>

#include "client/cpp/types.h"

namespace lpdeform::cli {

/// One line on stderr that is updated while work goes on. Silent if stderr is not a terminal.
class Progress {
 public:
  Progress();
  /// Clears the line.
  ~Progress();

  void show(const std::string& what);
  void show(const client::SolveProgress& progress);
  void clear();

 private:
  bool is_terminal_;
  bool is_shown_ = false;
};

}  // namespace lpdeform::cli
