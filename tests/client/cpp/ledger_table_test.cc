// The ledger of updates in tests/golden/recovery.json, which the clients in all languages replay.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cpp/ledger.h"

namespace lpdeform::client {
namespace {

using Json = nlohmann::json;
using Said = std::map<std::string, std::string>;

Update::Change change_of(const std::string& said) {
  const std::vector<std::string> words = absl::StrSplit(said, ' ');
  if (words[0] == "remove") return Update::Removal{};
  RigidMotion motion;
  EXPECT_TRUE(absl::SimpleAtod(words.at(1), &motion.translation[0]));
  if (words[0] == "move") return Motion(motion);
  return Handle{.vertices = {0}, .motion = motion};
}

std::string said_of(const Update::Change& change) {
  if (std::holds_alternative<Update::Removal>(change)) return "remove";
  const Handle* const handle = std::get_if<Handle>(&change);
  const auto& motion = std::get<RigidMotion>(handle ? handle->motion : std::get<Motion>(change));
  return absl::StrCat(handle ? "set " : "move ", motion.translation[0]);
}

class Replay {
 public:
  explicit Replay(bool is_bare) : ledger_(is_bare) { ledger_.begin_epoch(1); }

  void step(const Json& step) {
    SCOPED_TRACE(step.dump());
    doing_.at(step.at("do"))(step);
  }

 private:
  Said send(const Json& step) {
    if (!ledger_.has_waiting()) {
      ADD_FAILURE() << "nothing waits";
      return {};
    }
    const NumberedUpdate sent = ledger_.send_next();
    EXPECT_EQ(sent.seq, step.at("seq"));
    Said said;
    for (const auto& [name, change] : sent.update.handles) said[name] = said_of(change);
    return said;
  }

  void add(const Json& step) {
    Update update;
    for (const auto& [name, said] : step.at("handles").get<Said>()) update.handles[name] = change_of(said);
    ledger_.add(std::move(update));
  }

  void remove_many(const Json& step) {
    Update update;
    for (int k = 0; k < step.at("count").get<int>(); ++k)
      update.handles[absl::StrCat(step.value("prefix", ""), k)] = Update::Removal{};
    ledger_.add(std::move(update));
  }

  void count_sent(const Json& step) {
    std::map<std::string, int> kinds;
    for (const auto& [name, said] : send(step)) ++kinds[std::string(said, 0, said.find(' '))];
    EXPECT_EQ(kinds["set"], step.value("sets", 0));
    EXPECT_EQ(kinds["move"], step.value("moves", 0));
    EXPECT_EQ(kinds["remove"], step.value("removals", 0));
  }

  Ledger ledger_;
  const std::map<std::string, std::function<void(const Json&)>> doing_{
      {"add", [this](const Json& step) { add(step); }},
      {"send", [this](const Json& step) { EXPECT_EQ(send(step), step.at("handles").get<Said>()); }},
      {"send_many", [this](const Json& step) { send(step); }},
      {"sends", [this](const Json& step) { count_sent(step); }},
      {"remove_many", [this](const Json& step) { remove_many(step); }},
      {"accept", [this](const Json& step) { ledger_.accept(step.at("seq"), step.at("kept")); }},
      {"show", [this](const Json& step) { ledger_.show(step.value("epoch", 1), step.at("seq")); }},
      {"refuse", [this](const Json& step) { ledger_.refuse(step.at("seq")); }},
      {"connection_lost", [this](const Json&) { ledger_.connection_lost(); }},
      {"session_lost", [this](const Json&) { ledger_.session_lost(); }},
      {"drop_unaccepted", [this](const Json&) { ledger_.drop_unaccepted(); }},
      {"reopened", [this](const Json& step) { ledger_.reopened(step.at("epoch"), step.at("input_seq")); }},
      {"count_from", [this](const Json& step) { ledger_.count_from(step.at("input_seq")); }},
      {"newest", [this](const Json& step) { EXPECT_EQ(ledger_.newest(), step.at("newest")); }},
      {"nothing_waits", [this](const Json&) { EXPECT_FALSE(ledger_.has_waiting()); }}};
};

TEST(Ledger, IsAsTheTableOfAllClientsHasIt) {
  const Json table = Json::parse(std::ifstream(RECOVERY_TABLE));
  ASSERT_GT(table.at("ledger").size(), 15u);
  for (const Json& one : table.at("ledger")) {
    SCOPED_TRACE(one.at("name"));
    Replay replay(one.at("is_bare"));
    for (const Json& step : one.at("steps")) replay.step(step);
  }
}

}  // namespace
}  // namespace lpdeform::client
