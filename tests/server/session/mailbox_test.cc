#include "server/session/mailbox.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "bar.h"
#include "core/base/fault.h"

namespace lpdeform {
namespace {

class MailboxTest : public testing::Test {
 protected:
  Update ends(std::uint64_t seq, double x) const { return hold_ends(shape_->positions(), seq, x); }

  double tip_shift() const {
    const Inputs inputs = mailbox_.newest();
    return std::get<RigidMotion>(inputs.handles->handles().find("tip")->second.motion).translation.x();
  }

  bool has(const std::string& name) const { return mailbox_.newest().handles->handles().contains(name); }

  std::shared_ptr<const RestShape> shape_ = shape_of(bar_mesh());
  Mailbox mailbox_{shape_};
};

TEST_F(MailboxTest, KeepsTheNewestValueOfAHandle) {
  ASSERT_TRUE(mailbox_.take(ends(1, 0)).ok());
  ASSERT_TRUE(mailbox_.take(move_tip(3, 3)).ok());
  const auto late = mailbox_.take(move_tip(2, 2));
  ASSERT_TRUE(late.ok());
  EXPECT_EQ(late->stale_parts, 1u);
  EXPECT_EQ(tip_shift(), 3);
  EXPECT_EQ(mailbox_.newest().input_seq, 3u);
}

TEST_F(MailboxTest, ALateUpdateOfOneHandleDoesNotUndoAnother) {
  ASSERT_TRUE(mailbox_.take(ends(1, 0)).ok());
  ASSERT_TRUE(mailbox_.take(move_tip(3, 3)).ok());
  Update late = move_tip(2, 2);
  late.handles.push_back({"base", shifted(0, 1, 0)});
  const auto result = mailbox_.take(late);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->stale_parts, 1u);
  EXPECT_EQ(tip_shift(), 3);
  const Inputs inputs = mailbox_.newest();
  const auto& base = inputs.handles->handles().find("base")->second;
  EXPECT_EQ(std::get<RigidMotion>(base.motion).translation.y(), 1);
  EXPECT_EQ(inputs.input_seq, 3u);
}

TEST_F(MailboxTest, KeepsTheNewestRegion) {
  Update newer = ends(5, 0), late;
  newer.settings.region = std::vector<std::int32_t>{1, 2, 3};
  ASSERT_TRUE(mailbox_.take(newer).ok());
  late.input_seq = 4;
  late.settings.region = std::vector<std::int32_t>{};
  EXPECT_EQ(mailbox_.take(late).value().stale_parts, 1u);
  ASSERT_NE(mailbox_.newest().handles->region(), nullptr);
  EXPECT_EQ(mailbox_.newest().handles->region()->size(), 3u);
  late.input_seq = 6;
  ASSERT_TRUE(mailbox_.take(late).ok());
  EXPECT_EQ(mailbox_.newest().handles->region(), nullptr);
}

TEST_F(MailboxTest, RefusesLocksThatContradictEachOtherWhole) {
  ASSERT_TRUE(mailbox_.take(ends(1, 0)).ok());
  Update twice;
  twice.input_seq = 2;
  twice.handles.push_back({"one", Handle{{}, Fixed{}, Exactly{}, {{100, {0.2, 0.3, 0.5}}}}});
  twice.handles.push_back({"two", Handle{{}, Fixed{}, Exactly{}, {{100, {0.2, 0.3, 0.5}}}}});
  EXPECT_EQ(fault_of(mailbox_.take(twice).status()).reason, "HANDLE_CONSTRAINTS_DEPENDENT");
  EXPECT_FALSE(has("one"));
}

TEST_F(MailboxTest, SettingsAgeOneByOne) {
  Update newer;
  newer.input_seq = 5;
  newer.settings.p = Field::Constant(1, 1.5);
  ASSERT_TRUE(mailbox_.take(newer).ok());
  Update late;
  late.input_seq = 4;
  late.settings.p = Field::Constant(1, 3.0);
  late.settings.stiffness = Field::Constant(1, 7.0);
  late.settings.length_unit = 2.0;
  const auto result = mailbox_.take(late);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->stale_parts, 1u);
  const Inputs inputs = mailbox_.newest();
  EXPECT_EQ(inputs.material->p[0], 1.5);
  EXPECT_EQ(inputs.material->stiffness[0], 7.0);
  EXPECT_EQ(inputs.material->length_unit, 2.0);
}

TEST_F(MailboxTest, ALateMotionDoesNotBringBackAHandleThatWasLetGoOf) {
  ASSERT_TRUE(mailbox_.take(ends(1, 0)).ok());
  Update removal;
  removal.input_seq = 3;
  removal.handles.push_back({"tip", Removal{}});
  ASSERT_TRUE(mailbox_.take(removal).ok());
  const auto late = mailbox_.take(ends(2, 5));
  ASSERT_TRUE(late.ok());
  EXPECT_EQ(late->stale_parts, 1u);
  EXPECT_FALSE(has("tip"));
  EXPECT_TRUE(has("base"));
}

TEST_F(MailboxTest, ForgottenNamesStayStale) {
  for (std::uint64_t k = 0; k < 3 * InputLimits::kMostHandles; ++k) {
    Update update;
    update.input_seq = 10 + k;
    update.handles.push_back({absl::StrCat("h", k), Removal{}});
    ASSERT_TRUE(mailbox_.take(update).ok());
  }
  Update late;
  late.input_seq = 9;
  late.handles.push_back({"h0", Handle{{0}, Fixed{}}});
  const auto result = mailbox_.take(late);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->stale_parts, 1u);
  EXPECT_FALSE(has("h0"));
}

TEST_F(MailboxTest, ARepetitionChangesNothingAndIsNotStale) {
  ASSERT_TRUE(mailbox_.take(ends(1, 4)).ok());
  const std::uint64_t version = mailbox_.newest().version;
  const auto again = mailbox_.take(ends(1, 4));
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->stale_parts, 0u);
  EXPECT_EQ(mailbox_.newest().version, version);
}

TEST_F(MailboxTest, AnUpdateWithoutPartsIsStillToBeAnswered) {
  Update empty;
  empty.input_seq = 8;
  const std::uint64_t version = mailbox_.newest().version;
  ASSERT_TRUE(mailbox_.take(empty).ok());
  EXPECT_GT(mailbox_.newest().version, version);
  EXPECT_EQ(mailbox_.newest().input_seq, 8u);
  EXPECT_EQ(mailbox_.newest().taken, 1u);
}

TEST_F(MailboxTest, WhatASessionBeginsWithIsOlderThanEveryUpdate) {
  ASSERT_TRUE(mailbox_.begin_with(ends(0, 2)).ok());
  EXPECT_EQ(tip_shift(), 2);
  EXPECT_EQ(mailbox_.newest().input_seq, 0u);
  ASSERT_TRUE(mailbox_.take(move_tip(1, 1)).ok());
  EXPECT_EQ(tip_shift(), 1);
}

TEST_F(MailboxTest, HandlesMayComeOneByOne) {
  Update base = ends(1, 0);
  base.handles.resize(1);
  EXPECT_TRUE(mailbox_.take(base).ok());
}

/// A wrong update, made from one that holds both ends, and the reason that it is refused for.
struct Wrong {
  const char* name;
  std::function<void(Update&)> spoil;
  const char* reason = name;
};

std::ostream& operator<<(std::ostream& out, const Wrong& wrong) {
  return out << wrong.name;
}

class WrongUpdateTest : public MailboxTest, public testing::WithParamInterface<Wrong> {};

TEST_P(WrongUpdateTest, IsRefusedWholeWithItsReason) {
  ASSERT_TRUE(mailbox_.take(ends(1, 0)).ok());
  const Inputs before = mailbox_.newest();
  Update update = ends(2, 9);
  update.settings.p = Field::Constant(1, 1.25);
  GetParam().spoil(update);
  const auto result = mailbox_.take(update);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(fault_of(result.status()).reason, GetParam().reason);
  const Inputs after = mailbox_.newest();
  EXPECT_EQ(after.version, before.version);
  EXPECT_EQ(after.handles, before.handles);
  EXPECT_EQ(after.material, before.material);
  // Nor does it age anything: the next update is not stale.
  const auto next = mailbox_.take(ends(2, 1));
  ASSERT_TRUE(next.ok());
  EXPECT_EQ(next->stale_parts, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Reasons, WrongUpdateTest,
    testing::Values(
        Wrong{"INPUT_SEQ_ZERO", [](Update& u) { u.input_seq = 0; }},
        Wrong{"INPUT_SEQ_TOO_HIGH", [](Update& u) { u.input_seq = std::uint64_t{1} << 63; }},
        Wrong{"HANDLE_CHANGED_TWICE",
              [](Update& u) {
                u.handles.push_back({"tip", Removal{}});
              }},
        Wrong{"HANDLE_NAME", [](Update& u) { u.handles[1].name = ""; }},
        Wrong{"HANDLE_NAME_TOO_LONG",
              [](Update& u) {
                u.handles[1] = {std::string(129, 'x'), Removal{}};
              },
              "HANDLE_NAME"},
        Wrong{"HANDLE_EMPTY", [](Update& u) { u.handles[1].change = Handle{}; }},
        Wrong{"HANDLE_UNKNOWN",
              [](Update& u) {
                u.handles.push_back({"nobody", shifted(1, 0, 0)});
              }},
        Wrong{"HANDLE_VERTEX_OUT_OF_RANGE",
              [](Update& u) {
                u.handles[1].change = Handle{{370}, Fixed{}};
              }},
        Wrong{"HANDLE_VERTEX_TWICE",
              [](Update& u) {
                u.handles.push_back({"third", Handle{{0}, Fixed{}}});
              }},
        Wrong{
            "HANDLE_MOTION_NOT_FINITE",
            [](Update& u) { u.handles[1].change = shifted(std::numeric_limits<double>::quiet_NaN(), 0, 0); }},
        Wrong{"HANDLE_AXIS_ZERO",
              [](Update& u) {
                RigidMotion turn;
                turn.axis.setZero();
                turn.angle_radians = 1;
                u.handles[1].change = HandleMotion(turn);
              }},
        Wrong{"HANDLE_TARGET_COUNT",
              [](Update& u) { u.handles[1].change = HandleMotion(TargetPositions{Points::Zero(1, 3)}); }},
        Wrong{"HANDLE_TARGET_TOO_FAR", [](Update& u) { u.handles[1].change = shifted(1e300, 0, 0); }},
        Wrong{"P_OUT_OF_RANGE", [](Update& u) { u.settings.p = Field::Constant(1, 0.5); }},
        Wrong{"FIELD_SIZE", [](Update& u) { u.settings.p = Field::Constant(3, 2.0); }},
        Wrong{"STIFFNESS_OUT_OF_RANGE",
              [](Update& u) {
                u.settings.stiffness = Field::Constant(1, std::numeric_limits<double>::quiet_NaN());
              }},
        Wrong{"LENGTH_UNIT_OUT_OF_RANGE", [](Update& u) { u.settings.length_unit = -1.0; }},
        Wrong{"METHOD_NEEDS_P",
              [](Update& u) { u.settings.solver = SolveSettings{.method = Method::kConic}; }},
        Wrong{"TOLERANCE_OUT_OF_RANGE", [](Update& u) { u.settings.solver = SolveSettings{.tolerance = 1}; }},
        Wrong{"ITERATIONS_OUT_OF_RANGE",
              [](Update& u) { u.settings.solver = SolveSettings{.max_iterations = -1}; }},
        Wrong{"TIME_LIMIT_OUT_OF_RANGE",
              [](Update& u) { u.settings.solver = SolveSettings{.time_limit_seconds = -1}; }},
        Wrong{"TOO_MANY_HANDLES",
              [](Update& u) {
                for (std::size_t k = 0; k < InputLimits::kMostHandles; ++k) {
                  u.handles.push_back({absl::StrCat("h", k), Handle{{5}, Fixed{}}});
                }
              }}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace lpdeform
