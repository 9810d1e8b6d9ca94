#include "server/session/history.h"

#include <gtest/gtest.h>

#include "bar.h"
#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/session/mailbox.h"

namespace lpdeform {
namespace {

class HistoryTest : public testing::Test {
 protected:
  HistoryTest() {
    EXPECT_TRUE(mailbox_.take(hold_ends(shape_->positions(), ++seq_, 0)).ok());
    timers_->advance(std::chrono::seconds(10));
  }

  void move(double x, bool begins_step = false) {
    Update update = move_tip(++seq_, x);
    update.begins_step = begins_step;
    ASSERT_TRUE(mailbox_.take(update).ok());
  }

  /// Empty where it went well.
  std::string undo(bool redo = false) {
    const auto result = mailbox_.undo(seq_ + 1, redo);
    if (result.ok()) ++seq_;
    return fault_of(result.status()).reason;
  }
  std::string redo() { return undo(true); }

  double tip() const {
    const Inputs inputs = mailbox_.newest();
    return std::get<RigidMotion>(inputs.handles->handles().find("tip")->second.motion).translation.x();
  }
  bool has(const std::string& name) const { return mailbox_.newest().handles->handles().contains(name); }

  const std::shared_ptr<const RestShape> shape_ = shape_of(bar_mesh());
  const std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  Mailbox mailbox_{shape_, nullptr, {100, 5}, timers_};
  std::uint64_t seq_ = 0;
};

TEST_F(HistoryTest, ADragIsOneStep) {
  for (int k = 1; k <= 50; ++k) move(k);
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(tip(), 0);
  EXPECT_EQ(redo(), "");
  EXPECT_EQ(tip(), 50);
}

TEST_F(HistoryTest, APauseAMarkAndAnotherHandleEachBeginAStep) {
  move(1);
  timers_->advance(HandleHistory::kPause);
  move(2);  // just in time
  timers_->advance(HandleHistory::kPause + std::chrono::milliseconds(1));
  move(3);
  move(4, true);
  Update other;
  other.input_seq = ++seq_;
  other.handles.push_back({"base", shifted(0, 1, 0)});
  ASSERT_TRUE(mailbox_.take(other).ok());
  EXPECT_EQ(mailbox_.history_size().undo_steps, 5u);  // the first set both
  for (const double x : {4.0, 3.0, 2.0, 0.0}) {
    EXPECT_EQ(undo(), "");
    EXPECT_EQ(tip(), x);
  }
}

TEST_F(HistoryTest, AnUpdateThatLeavesHandlesAsTheyAreIsNoStep) {
  move(1);
  timers_->advance(std::chrono::seconds(10));
  move(1);  // as it is
  Update again;
  again.input_seq = ++seq_;
  for (const auto& [name, handle] : mailbox_.newest().given_handles->handles())
    again.handles.push_back({name, handle});
  again.handles.push_back({"of old", Removal{}});
  ASSERT_TRUE(mailbox_.take(again).ok());
  EXPECT_EQ(mailbox_.history_size().undo_steps, 2u);
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(tip(), 0);
  move(0);  // as it is
  EXPECT_EQ(redo(), "");
  EXPECT_EQ(tip(), 1);
  move(1, true);  // where a drag begins that was marked
  move(2);
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(tip(), 1);
}

TEST_F(HistoryTest, HandlesThatWereSetReplacedAndLetGoOfComeAndGo) {
  const std::vector<std::int32_t> middle = vertices_at(shape_->positions(), 5);
  const std::int32_t a = middle[0], b = middle[1], c = middle[2];
  Update update{++seq_, {{"ear", Handle{{a, b}, shifted(1, 0, 0)}}}, {}};
  ASSERT_TRUE(mailbox_.take(update).ok());
  update = {++seq_, {{"ear", Handle{{c}, shifted(2, 0, 0), Soft{0.5}}}}, {}};
  ASSERT_TRUE(mailbox_.take(update).ok());
  update = {++seq_, {{"ear", Removal{}}, {"nobody", Removal{}}}, {}};
  ASSERT_TRUE(mailbox_.take(update).ok());
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(mailbox_.newest().given_handles->handles().at("ear"), (Handle{{c}, shifted(2, 0, 0), Soft{0.5}}));
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(mailbox_.newest().given_handles->handles().at("ear"), (Handle{{a, b}, shifted(1, 0, 0)}));
  EXPECT_EQ(undo(), "");
  EXPECT_FALSE(has("ear"));
  EXPECT_EQ(redo(), "");
  EXPECT_EQ(redo(), "");
  EXPECT_EQ(mailbox_.newest().given_handles->handles().at("ear").vertices, std::vector<std::int32_t>{c});
  EXPECT_EQ(redo(), "");
  EXPECT_FALSE(has("ear"));
  EXPECT_EQ(redo(), "NOTHING_TO_REDO");
}

TEST_F(HistoryTest, AnUpdateEndsWhatCouldBeDoneAgainAndSettingsDoNot) {
  move(1);
  EXPECT_EQ(undo(), "");
  Update settings;
  settings.input_seq = ++seq_;
  settings.settings.p = Field::Constant(1, 1.5);
  ASSERT_TRUE(mailbox_.take(settings).ok());
  EXPECT_EQ(mailbox_.history_size().redo_steps, 1u);
  EXPECT_EQ(redo(), "");
  EXPECT_EQ(undo(), "");
  move(7);
  EXPECT_EQ(redo(), "NOTHING_TO_REDO");
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(tip(), 0);
}

TEST_F(HistoryTest, AMoveAfterAnUndoIsAStepOfItsOwn) {
  move(1);
  move(2, true);
  EXPECT_EQ(undo(), "");
  move(5);  // the same handle, at once
  EXPECT_EQ(undo(), "");
  EXPECT_EQ(tip(), 1);
}

TEST_F(HistoryTest, TheOldestStepsGoFirst) {
  for (int k = 1; k <= 9; ++k) move(k, true);
  for (int k = 8; k >= 4; --k) {
    EXPECT_EQ(undo(), "");
    EXPECT_EQ(tip(), k);
  }
  EXPECT_EQ(undo(), "NOTHING_TO_UNDO");
  EXPECT_EQ(tip(), 4);
}

TEST_F(HistoryTest, TheSameCallAgainDoesNothingAndALateOneIsRefused) {
  for (int k = 1; k <= 3; ++k) move(k, true);
  const auto first = mailbox_.undo(100, false), again = mailbox_.undo(100, false);
  ASSERT_TRUE(first.ok() && again.ok());
  EXPECT_EQ(again->undo_steps, first->undo_steps);
  EXPECT_EQ(again->changes.size(), 1u);
  EXPECT_EQ(tip(), 2);
  EXPECT_EQ(fault_of(mailbox_.undo(100, true).status()).reason, "INPUT_SEQ_PASSED");
  EXPECT_EQ(fault_of(mailbox_.undo(99, false).status()).reason, "INPUT_SEQ_PASSED");
  const std::uint64_t highest = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(fault_of(mailbox_.undo(highest, false).status()).reason, "INPUT_SEQ_TOO_HIGH");
  const auto late = mailbox_.take(move_tip(50, 9));  // sent before, comes after
  ASSERT_TRUE(late.ok());
  EXPECT_EQ(late->stale_parts, 1u);
  EXPECT_EQ(tip(), 2);
}

TEST_F(HistoryTest, AStepThatIsTooLargeEndsWhatWasBefore) {
  move(1, true);
  Handle large{{}, TargetPositions{Points::Zero(100'000, 3)}};
  const HandleSet before = [&] {
    HandleSet set;
    large.vertices.resize(100'000);
    EXPECT_TRUE(set.set("large", large).ok());
    return set;
  }();
  HandleHistory history(10);
  const Timers::TimePoint now;
  HandleSet small;
  ASSERT_TRUE(small.set("tip", Handle{{1}, shifted(0, 0, 0)}).ok());
  const HandleSet none;  // another one
  history.note(small, none, {{}, {"tip"}, {}, true}, now, 1);
  EXPECT_EQ(history.undo_steps(), 1u);
  history.note(before, none, {{"large"}, {"large"}, {}, true}, now, 2);
  EXPECT_EQ(history.undo_steps(), 0u);
  EXPECT_EQ(history.bytes(), 0u);
  history.note(small, none, {{}, {"tip"}, {}, true}, now, 3);
  EXPECT_EQ(history.undo_steps(), 1u);
}

TEST_F(HistoryTest, AStoreIsToldOfEachStepOnceAndOfThoseThatWent) {
  const auto numbers = [&](std::uint64_t revision, bool is_there) {
    const HandleHistory::Changes changes = mailbox_.changes_since(revision).steps;
    std::vector<std::uint64_t> found;
    for (const auto& [number, step] : changes.steps) found.push_back(number);
    return is_there ? found : changes.dropped;
  };
  move(1, true);
  const std::uint64_t before = mailbox_.revision();
  move(2);  // the same step: nothing is new of it
  EXPECT_TRUE(numbers(before, true).empty());
  move(3, true);
  EXPECT_EQ(numbers(before, true), std::vector<std::uint64_t>{2});
  EXPECT_EQ(undo(), "");
  const std::uint64_t undone = mailbox_.revision();
  EXPECT_EQ(mailbox_.changes_since(0).history.undo_steps, 2u);
  EXPECT_EQ(mailbox_.changes_since(0).history.steps, 3u);
  Update other{++seq_, {{"base", shifted(0, 1, 0)}}, {}};
  ASSERT_TRUE(mailbox_.take(other).ok());  // in place of the step that was taken back
  EXPECT_EQ(numbers(undone, true), std::vector<std::uint64_t>{2});
  EXPECT_TRUE(numbers(undone, false).empty());
  for (int k = 1; k <= 4; ++k) move(10 + k, true);
  EXPECT_EQ(numbers(undone, false), (std::vector<std::uint64_t>{0, 1}));
}

TEST_F(HistoryTest, WithoutRoomForAnyThereIsNone) {
  Mailbox mailbox(shape_, nullptr, {100, 0}, timers_);
  ASSERT_TRUE(mailbox.take(hold_ends(shape_->positions(), 1, 0)).ok());
  EXPECT_EQ(fault_of(mailbox.undo(2, false).status()).reason, "NOTHING_TO_UNDO");
}

}  // namespace
}  // namespace lpdeform
