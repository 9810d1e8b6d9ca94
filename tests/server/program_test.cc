// The program lpdeform-server as an operator runs it.

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "server/health_probe.h"

namespace lpdeform {
namespace {

/// The program, running; its stdout and stderr come through one pipe. Of this process's environment it gets
/// all but the program's own settings.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments, std::vector<std::string> environment = {}) {
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
    arguments.insert(arguments.begin(), LPDEFORM_SERVER_PROGRAM);
    EXPECT_EQ(posix_spawn(&pid_, LPDEFORM_SERVER_PROGRAM, &actions, nullptr, pointers(arguments).data(),
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

TEST(Program, PrintsItsAddressServesAndExitsCleanlyWhenStopped) {
  for (const int number : {SIGTERM, SIGINT}) {
    Program program({"--address", "127.0.0.1:0", "--grace", "5"});
    const std::string address = program.address();
    ASSERT_FALSE(address.empty());
    EXPECT_TRUE(is_serving(address));
    program.signal(number);
    EXPECT_EQ(program.wait(), 0);
  }
}

TEST(Program, LogsOneJsonObjectAnEvent) {
  Program program({"--address", "127.0.0.1:0"});
  ASSERT_FALSE(program.address().empty());
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  std::istringstream lines(program.rest());
  std::vector<std::string> events;
  for (std::string text; std::getline(lines, text);) {
    const auto event = nlohmann::json::parse(text);
    EXPECT_TRUE(event.contains("time"));
    EXPECT_EQ(event.at("level"), "info");
    events.push_back(event.at("event"));
  }
  ASSERT_GE(events.size(), 2u);
  EXPECT_EQ(events.back(), "stopped");
}

TEST(Program, TakesItsOptionsFromTheEnvironmentToo) {
  Program program({}, {"LPDEFORM_ADDRESS=127.0.0.1:0", "LPDEFORM_LOG_LEVEL=off"});
  const std::string address = program.address();
  ASSERT_FALSE(address.empty());
  EXPECT_FALSE(address.ends_with(":0"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  EXPECT_EQ(program.rest(), "");
}

TEST(Program, HelpNamesEveryOptionsVariable) {
  Program program({"--help"});
  const std::string help = program.rest();
  EXPECT_EQ(program.wait(), 0);
  for (const char* const name :
       {"ADDRESS", "THREADS", "RUNNER_THREADS", "MAX_SESSIONS", "MAX_VERTICES", "MAX_BYTES",
        "MAX_UPLOAD_BYTES", "SESSION_IDLE", "UPLOAD_IDLE", "HEARTBEAT", "GRACE", "LOG_LEVEL"}) {
    EXPECT_NE(help.find(std::string("LPDEFORM_") + name), std::string::npos) << name;
  }
}

TEST(Program, RefusesWrongOptionsAndTakenAddresses) {
  Program wrong({"--threads", "many"});
  EXPECT_NE(wrong.wait(), 0);
  Program first({"--address", "127.0.0.1:0"});
  const std::string address = first.address();
  Program second({"--address", address, "--log-level", "off"});
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.rest().find(address), std::string::npos);
}

TEST(Program, HealthcheckSaysWhetherAServerServes) {
  Program server({"--address", "127.0.0.1:0"});
  const std::string address = server.address();
  EXPECT_EQ(Program({"--healthcheck", address}).wait(), 0);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_EQ(Program({"--healthcheck", address}).wait(), 1);
}

}  // namespace
}  // namespace lpdeform
