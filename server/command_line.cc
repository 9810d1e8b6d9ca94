#include "server/command_line.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/runtime/machine_memory.h"

namespace lpdeform {
namespace {

const char* heading(FlagGroup group) {
  switch (group) {
    case FlagGroup::kAddresses:
      return "Addresses";
    case FlagGroup::kAccess:
      return "Who may call";
    case FlagGroup::kThreads:
      return "Threads";
    case FlagGroup::kLimits:
      return "Limits";
    case FlagGroup::kStore:
      return "What is kept";
    case FlagGroup::kProgram:
      return "The program";
  }
  return "";
}

template <typename Number>
Number number_of(const Flag& flag, const std::string& text) {
  Number number{};
  const bool is_number = CLI::detail::lexical_cast(text, number);
  const absl::Status in_range =
      is_number ? check_range(flag, static_cast<double>(number)) : must_be(flag.name, flag.range.text);
  if (!in_range.ok()) throw CLI::ValidationError(std::string(in_range.message()));
  return number;
}

/// "4GiB" or "4096". CLI11's own conversion takes -1 for the largest size, and throws at an overflow without the flag's name.
std::uint64_t size_of(const Flag& flag, std::string text) {
  const auto is_size = [&text] {
    try {
      return text.find('-') == std::string::npos && CLI::AsSizeValue(false)(text).empty();
    } catch (const CLI::ValidationError&) {
      return false;
    }
  };
  if (is_size()) return std::stoull(text);
  throw CLI::ValidationError(
      absl::StrCat("--", flag.name, " must be a size below 16 EiB, such as 4GiB or 4096."));
}

bool is_share(const std::string& text) {
  return !text.empty() && text.back() == '%';
}

/// The number before "%".
double percent_of(const Flag& flag, const std::string& text) {
  return number_of<double>(flag, text.substr(0, text.size() - 1));
}

/// Puts the value that `text` says where the flag says.
struct Read {
  const Flag& flag;
  const std::string& text;

  void operator()(std::string* to) const { *to = text; }
  void operator()(bool*) const {}  // of flags without a value: CLI11 sets it
  template <typename Number>
  void operator()(Number* to) const {
    *to = number_of<Number>(flag, text);
  }
  void operator()(std::chrono::milliseconds* to) const {
    const double seconds = number_of<double>(flag, text);
    *to = std::chrono::milliseconds(static_cast<std::int64_t>(1000 * seconds));
  }
  void operator()(ByteLimit* to) const {
    *to = is_share(text) ? ByteLimit{.percent = percent_of(flag, text)}
                         : ByteLimit{.bytes = size_of(flag, text)};
  }
  void operator()(const SizeValue& to) const {
    *to.bytes = size_of(flag, text);
    if (const absl::Status in_range = check_range(flag); !in_range.ok())
      throw CLI::ValidationError(std::string(in_range.message()));
  }
  void operator()(const MemoryValue& to) const {
    *to.bytes = is_share(text) ? static_cast<std::size_t>(static_cast<double>(memory_of_process()) *
                                                          percent_of(flag, text) / 100)
                               : size_of(flag, text);
  }
};

struct TypeName {
  const Flag& flag;

  const char* operator()(const std::string*) const { return flag.type; }
  const char* operator()(const bool*) const { return ""; }
  const char* operator()(const double*) const { return "NUMBER"; }
  const char* operator()(const std::chrono::milliseconds*) const { return "SECONDS"; }
  const char* operator()(const ByteLimit*) const { return "SIZE"; }
  const char* operator()(const SizeValue&) const { return "SIZE"; }
  const char* operator()(const MemoryValue&) const { return "SIZE"; }
  template <typename Count>
  const char* operator()(const Count*) const {
    return "COUNT";
  }
};

CLI::Option* add(CLI::App& app, const Flag& flag) {
  const std::string name = absl::StrCat("--", flag.name), help = help_of(flag);
  if (bool* const* const is_set = std::get_if<bool*>(&flag.value)) return app.add_flag(name, **is_set, help);
  const auto read = [flag](const std::string& text) { std::visit(Read{flag, text}, flag.value); };
  CLI::Option* const option = app.add_option_function<std::string>(name, read, help);
  option->type_name(std::visit(TypeName{flag}, flag.value))->default_str(value_of(flag));
  if (!flag.choices.empty()) option->check(CLI::IsMember(flag.choices));
  return option;
}

}  // namespace

void add_flags(CLI::App& app, const std::vector<Flag>& flags) {
  for (const Flag& flag : flags) {
    CLI::Option* const option = add(app, flag)->group(heading(flag.group));
    if (flag.is_in_environment) option->envname(environment_variable(flag));
  }
  for (const Flag& flag : flags) {
    if (flag.needs.empty()) continue;
    app.get_option(absl::StrCat("--", flag.name))->needs(app.get_option(absl::StrCat("--", flag.needs)));
  }
}

}  // namespace lpdeform
