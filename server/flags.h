#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "core/base/reasons.h"
#include "server/calls/options.h"
#include "server/store/open_store.h"

namespace lpdeform {

/// All that lpdeform-server can be told when it starts.
struct Arguments {
  Arguments();

  ServerOptions server;
  std::string store = "none";
  StoreOptions store_options;
  std::chrono::milliseconds grace = std::chrono::seconds(20);
  std::string log_level = "info";
  std::string probed;
};

/// The headings of --help.
enum class FlagGroup { kAddresses, kAccess, kThreads, kLimits, kStore, kProgram };

/// A size in bytes: "4096" or "256MiB".
struct SizeValue {
  std::uint64_t* bytes;
};

/// The same, or a share of the memory that this process may have: "25%". A range bounds the share.
struct MemoryValue {
  std::size_t* bytes;
};

/// Where the value is stored. Its content before parsing is the default. Durations are given in seconds, a ByteLimit as a
/// size or a share of another limit.
using FlagValue = std::variant<std::string*, bool*, int*, std::uint32_t*, std::size_t*, double*,
                               std::chrono::milliseconds*, ByteLimit*, SizeValue, MemoryValue>;

/// What a number must be.
struct FlagRange {
  const char* text = "";  // "1 to 10^6"; empty: it may be any
  double least = 0;
  double most = std::numeric_limits<double>::max();
  bool or_zero = false;
};

/// One flag. Reading the command line and the environment, --help, checks of ranges and the table in server/flags.md are made of
/// these.
struct Flag {
  std::string name;  // "max-sessions" is --max-sessions and LPDEFORM_MAX_SESSIONS
  FlagGroup group;
  FlagValue value;
  std::string help;  // without the range
  FlagRange range = {};
  std::optional<Reason> refusal = {};     // the reason sent to callers who exceed this limit
  std::string needs = {};                 // a flag without which it makes no sense
  std::vector<std::string> choices = {};  // empty: any text
  const char* type = "TEXT";              // of a text, in --help
  bool is_in_environment = true;
};

/// Those of a server, and all of the program's. They point into `options` and `arguments`.
std::vector<Flag> flags_of(ServerOptions& options);
std::vector<Flag> flags_of(Arguments& arguments);

/// "LPDEFORM_MAX_SESSIONS"
std::string environment_variable(const Flag& flag);

/// The help with the range.
std::string help_of(const Flag& flag);

/// The present value: "256", "600", "256MiB", "50%". Before the command line is read it is the default.
std::string value_of(const Flag& flag);

/// INVALID_ARGUMENT OPTION_OUT_OF_RANGE: "--max-sessions must be 1 to 10^6." The element is "max_sessions".
absl::Status must_be(const std::string& name, const std::string& what);

/// must_be() where `number`, or the present value, is not in the flag's range.
absl::Status check_range(const Flag& flag, double number);
absl::Status check_range(const Flag& flag);

/// The table of limits, in Markdown: flag, default, what it bounds, and what those are told who pass it.
std::string table_of_limits();

}  // namespace lpdeform
