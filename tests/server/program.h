#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace lpdeform {

/// The program, running; its stdout and stderr come through one pipe. Of this process's environment it gets
/// all but the program's own settings.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments, std::vector<std::string> environment = {},
                   const char* program = LPDEFORM_SERVER_PROGRAM) {
    for (char** entry = environ; *entry != nullptr; ++entry) {
      if (!std::string_view(*entry).starts_with("LPDEFORM_")) environment.emplace_back(*entry);
    }
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    arguments.insert(arguments.begin(), program);
    EXPECT_EQ(posix_spawn(&pid_, program, &actions, nullptr, pointers(arguments).data(),
                          pointers(environment).data()),
              0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }

  ~Program() {
    if (pid_ != 0) {
      kill(pid_, SIGKILL);
      wait();
    }
    std::fclose(output_);
  }

  /// The next line; empty at the end.
  std::string line() {
    std::string text;
    for (int c = std::fgetc(output_); c != EOF && c != '\n'; c = std::fgetc(output_))
      text.push_back(static_cast<char>(c));
    return text;
  }

  std::string rest() {
    std::string text;
    for (int c = std::fgetc(output_); c != EOF; c = std::fgetc(output_)) text.push_back(static_cast<char>(c));
    return text;
  }

  /// The address that it says it listens on.
  std::string address() {
    const std::string before = "lpdeform-server listens on ";
    for (std::string text = line(); !text.empty(); text = line()) {
      if (text.starts_with(before)) return text.substr(before.size());
    }
    return "";
  }

  pid_t pid() const { return pid_; }
  void signal(int number) const { kill(pid_, number); }

  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  static std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
  }

  pid_t pid_ = 0;
  FILE* output_ = nullptr;
};

}  // namespace lpdeform
