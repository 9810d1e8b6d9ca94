// The rules of what clients do after a stream, an answer or a loss: tests/golden/recovery.json, which all clients replay.

#include "client/cpp/recovery.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/escaping.h"
#include "client/cpp/client.h"
#include "client/cpp/status_details.h"
#include "client/cpp/wire.h"
#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

using Json = nlohmann::json;

const Json& table() {
  static const Json read = Json::parse(std::ifstream(RECOVERY_TABLE));
  return read;
}

const std::map<std::string, absl::StatusCode>& codes() {
  static const std::map<std::string, absl::StatusCode> all{
      {"ok", absl::StatusCode::kOk},
      {"cancelled", absl::StatusCode::kCancelled},
      {"unknown", absl::StatusCode::kUnknown},
      {"invalid_argument", absl::StatusCode::kInvalidArgument},
      {"deadline_exceeded", absl::StatusCode::kDeadlineExceeded},
      {"not_found", absl::StatusCode::kNotFound},
      {"already_exists", absl::StatusCode::kAlreadyExists},
      {"permission_denied", absl::StatusCode::kPermissionDenied},
      {"resource_exhausted", absl::StatusCode::kResourceExhausted},
      {"failed_precondition", absl::StatusCode::kFailedPrecondition},
      {"aborted", absl::StatusCode::kAborted},
      {"out_of_range", absl::StatusCode::kOutOfRange},
      {"unimplemented", absl::StatusCode::kUnimplemented},
      {"internal", absl::StatusCode::kInternal},
      {"unavailable", absl::StatusCode::kUnavailable},
      {"data_loss", absl::StatusCode::kDataLoss},
      {"unauthenticated", absl::StatusCode::kUnauthenticated}};
  return all;
}

absl::Status error_of(const Json& said) {
  const absl::StatusCode code = codes().at(said.at("code"));
  const std::string reason = said.value("reason", "");
  const absl::Status error =
      reason.empty() ? absl::Status(code, "No.") : carry_fault(code, {reason, "", ""}, "No.");
  return with_retry_after(error, std::chrono::milliseconds(said.value("retry_after_ms", 0)));
}

Ending ending_of(const Json& step) {
  Ending ending;
  if (step.contains("ended")) ending.status = error_of(step["ended"]);
  if (step.contains("go_away")) {
    v1::GoAwayReason reason{};
    EXPECT_TRUE(v1::GoAwayReason_Parse("GO_AWAY_REASON_" + step["go_away"].value("reason", ""), &reason));
    ending.go_away.emplace().set_reason(reason);
    ending.go_away->set_reconnect_after_ms(step["go_away"].at("reconnect_after_ms"));
  }
  ending.stood = std::chrono::milliseconds(step.value("stood_ms", 0));
  ending.away = std::chrono::milliseconds(step.value("away_ms", 0));
  return ending;
}

const std::map<std::string, NextStep> kNextSteps{
    {"resume", NextStep::kResume}, {"recreate", NextStep::kRecreate}, {"give_up", NextStep::kGiveUp}};
const std::map<std::string, Answer> kAnswers{{"again", Answer::kAgain},
                                             {"recreate", Answer::kRecreate},
                                             {"taken", Answer::kTaken},
                                             {"refused", Answer::kRefused}};

TEST(Recovery, IsAsTheTableOfAllClientsHasIt) {
  ASSERT_GT(table().at("ends").size(), 40u);
  for (const int chance : {0, 1}) {
    for (const Json& one : table().at("ends")) {
      SCOPED_TRACE(one.at("name"));
      RecoveryRules rules(one.at("has_copy"), std::chrono::milliseconds(one.at("reconnect_for_ms")),
                          Backoff([chance] { return chance; }));
      for (const Json& step : one.at("steps")) {
        if (step.value("fitted", false)) rules.frame_fitted();
        if (step.value("begin", false)) rules.begin();
        const Recovery recovery = step.contains("failed_making")
                                      ? rules.after_failed_making(error_of(step["failed_making"]))
                                      : rules.after(ending_of(step));
        EXPECT_EQ(recovery.next, kNextSteps.at(step.at("next")));
        EXPECT_EQ(recovery.why.code(), codes().at(step.at("code")));
        EXPECT_EQ(fault_of(recovery.why).reason, step.at("reason").get<std::string>());
        EXPECT_EQ(recovery.pause.count(), step.at("pause_ms").at(chance));
      }
    }
  }
}

TEST(Recovery, AnswersMeanWhatTheTableOfAllClientsSays) {
  ASSERT_GT(table().at("answers").size(), 20u);
  for (const Json& one : table().at("answers")) {
    SCOPED_TRACE(one.dump());
    EXPECT_EQ(answer_of(error_of(one.at("error")), one.value("is_second", false)),
              kAnswers.at(one.at("outcome")));
  }
}

/// Of a call in google.rpc.RetryInfo, inside a stream in Fault.
TEST(RetryAfter, IsReadFromEveryRecordedError) {
  int asking = 0;
  for (const Json& one : Json::parse(std::ifstream(RECORDED_ERRORS))) {
    SCOPED_TRACE(one.at("text"));
    const auto decoded = [&one](const char* field) {
      std::string bytes;
      EXPECT_TRUE(absl::Base64Unescape(one.at(field).get<std::string>(), &bytes));
      return bytes;
    };
    v1::Fault fault;
    ASSERT_TRUE(fault.ParseFromString(decoded("fault")));
    const absl::Status of_call =
        with_details(static_cast<absl::StatusCode>(one.at("code").get<int>()), "", decoded("details"));
    EXPECT_EQ(retry_after(of_call).count(), fault.retry_after_ms());
    EXPECT_EQ(retry_after(from_wire(fault)).count(), fault.retry_after_ms());
    asking += fault.retry_after_ms() > 0 ? 1 : 0;
  }
  EXPECT_GT(asking, 5);
}

TEST(Backoff, SpreadsItsPausesByChance) {
  std::map<std::int64_t, int> pauses;
  for (int k = 0; k < 100; ++k) ++pauses[Backoff().next().count()];
  EXPECT_GT(pauses.size(), 5u);
  EXPECT_GE(pauses.begin()->first, 25);
  EXPECT_LE(pauses.rbegin()->first, 50);
}

}  // namespace
}  // namespace lpdeform::client
