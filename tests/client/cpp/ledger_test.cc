#include "client/cpp/ledger.h"

#include <gtest/gtest.h>

namespace lpdeform::client {
namespace {

Update adding(const std::string& name, std::vector<std::uint32_t> vertices) {
  Update update;
  update.handles.emplace(name, Handle{std::move(vertices), Fixed{}});
  return update;
}

Update moving(const std::string& name, double x) {
  Update update;
  update.handles.emplace(name, Motion(RigidMotion{.translation = {x, 0, 0}}));
  return update;
}

Update removing(const std::string& name) {
  Update update;
  update.handles.emplace(name, Update::Removal{});
  return update;
}

Update with_p(double p) {
  Update update;
  update.settings.p = p;
  return update;
}

double translation_x(const Motion& motion) {
  return std::get<RigidMotion>(motion).translation[0];
}

TEST(Ledger, SendsOnlyMovesBesideEachOtherIfUpdatesMayOvertake) {
  Ledger ledger(true, Order::kAny);
  ledger.add(moving("tip", 1));
  ledger.send_next();
  ledger.add(moving("tip", 2));
  EXPECT_TRUE(ledger.can_send());
  ledger.send_next();
  ledger.add(moving("tip", 3));
  EXPECT_FALSE(ledger.can_send()) << "two are under way";
  ledger.accept(1);
  EXPECT_TRUE(ledger.can_send());
  ledger.add(adding("base", {0}));
  EXPECT_FALSE(ledger.can_send()) << "a handle is set";
  ledger.accept(2);
  EXPECT_TRUE(ledger.can_send());
  ledger.send_next();
  ledger.add(moving("base", 1));
  EXPECT_FALSE(ledger.can_send()) << "the handle that it moves may not be there yet";
}

TEST(Ledger, WaitsForStepsAndSettingsIfUpdatesMayOvertake) {
  Update step = moving("tip", 1);
  step.begins_step = true;
  Update resize;
  resize.resize = Resize{.scale = {2, 1, 1}};
  for (const Update& alone : {step, with_p(2), removing("tip"), resize}) {
    Ledger ledger(true, Order::kAny);
    ledger.add(moving("tip", 0));
    ledger.send_next();
    ledger.add(alone);
    EXPECT_FALSE(ledger.can_send());
    ledger.accept(1);
    EXPECT_TRUE(ledger.can_send());
  }
}

TEST(Ledger, KeepsTheNewestMotionHoweverAnswersOvertakeEachOther) {
  Ledger ledger(true, Order::kAny);
  ledger.add(adding("tip", {1}));
  ledger.send_next();
  ledger.accept(1);
  ledger.add(moving("tip", 1));
  ledger.send_next();
  ledger.add(moving("tip", 2));
  ledger.send_next();
  ledger.accept(3);
  ledger.accept(2);
  ledger.session_lost();
  const NumberedUpdate restored = ledger.send_next();
  EXPECT_EQ(restored.seq, 3u);
  EXPECT_EQ(translation_x(std::get<Handle>(restored.update.handles.at("tip")).motion), 2);
}

TEST(Ledger, ARestoreHasWhatIsAcceptedWhileItWaitsAndWhileItIsUnderWay) {
  Ledger ledger(true, Order::kAny);
  ledger.add(adding("tip", {1}));
  ledger.send_next();
  ledger.accept(1);
  ledger.add(moving("tip", 5));
  ledger.send_next();
  ledger.resumed_at(0);
  ledger.accept(2);
  const NumberedUpdate restored = ledger.send_next();
  EXPECT_EQ(restored.seq, 2u);
  EXPECT_EQ(translation_x(std::get<Handle>(restored.update.handles.at("tip")).motion), 5);
  ledger.accept(2);

  ledger.add(moving("tip", 6));
  ledger.send_next();
  ledger.accept(3, true);
  ledger.add(moving("tip", 7));
  ledger.send_next();
  ledger.accept(4);
  ledger.resumed_at(3);
  EXPECT_EQ(ledger.send_next().seq, 4u);
  ledger.add(moving("tip", 8));
  ledger.send_next();
  ledger.accept(5);
  ledger.connection_lost();
  const NumberedUpdate again = ledger.send_next();
  EXPECT_EQ(again.seq, 5u);
  EXPECT_EQ(translation_x(std::get<Motion>(again.update.handles.at("tip"))), 8);
}

TEST(Ledger, MergesWhatWaitsWithTheNewestValueWinning) {
  Ledger ledger;
  ledger.add(moving("tip", 1));
  ledger.add(with_p(1.5));
  EXPECT_EQ(ledger.add(moving("tip", 2)), 3u);
  const NumberedUpdate sent = ledger.send_next();
  EXPECT_EQ(sent.seq, 3u);
  EXPECT_EQ(translation_x(std::get<Motion>(sent.update.handles.at("tip"))), 2);
  EXPECT_EQ(std::get<double>(*sent.update.settings.p), 1.5);
  EXPECT_FALSE(ledger.has_waiting());
}

Update resizing(double factor) {
  Update update;
  update.resize = Resize{.scale = {factor, 1, 1}};
  return update;
}

TEST(Ledger, AResizingReplacesTheFieldsBeforeItAndNotThoseAfterIt) {
  Update state = with_p(3);
  state.settings.stiffness = 2.0;
  merge(state, resizing(2));
  EXPECT_FALSE(state.settings.p || state.settings.stiffness);
  merge(state, with_p(1.5));
  merge(state, resizing(4));
  EXPECT_FALSE(state.settings.p);
  merge(state, with_p(1.25));
  ASSERT_TRUE(state.resize);
  EXPECT_EQ(state.resize->scale[0], 4);
  EXPECT_EQ(std::get<double>(*state.settings.p), 1.25);
}

TEST(Ledger, AResizingEndsWithItsHandle) {
  Ledger ledger;
  ledger.add(resizing(2));
  ledger.accept(ledger.send_next().seq);
  ledger.session_lost();
  EXPECT_TRUE(ledger.send_next().update.resize);  // recreated with it
  Update state = resizing(2);
  merge(state, removing("resize"));
  EXPECT_FALSE(state.resize);
}

TEST(Ledger, AMotionMovesTheHandleThatWaitsToBeAdded) {
  Ledger ledger;
  ledger.add(adding("tip", {7, 8}));
  ledger.add(moving("tip", 2));
  const NumberedUpdate sent = ledger.send_next();
  const Handle& handle = std::get<Handle>(sent.update.handles.at("tip"));
  EXPECT_EQ(handle.vertices, (std::vector<std::uint32_t>{7, 8}));
  EXPECT_EQ(translation_x(handle.motion), 2);
}

TEST(Ledger, AMotionKeepsHowTheWaitingHandleIsHeldAndTheNewestRegionWins) {
  Ledger ledger;
  Update soft;
  soft.handles.emplace("tip", Handle{.vertices = {7}, .hold = Soft{3}, .footprint = 2});
  soft.settings.region = RegionOfInterest{{1, 2, 3}};
  ledger.add(soft);
  ledger.add(moving("tip", 2));
  Update wider;
  wider.settings.region = RegionOfInterest{{1, 2, 3, 4}};
  ledger.add(wider);
  const NumberedUpdate sent = ledger.send_next();
  const Handle& handle = std::get<Handle>(sent.update.handles.at("tip"));
  EXPECT_EQ(std::get<Soft>(handle.hold).weight, 3);
  EXPECT_EQ(handle.footprint, 2);
  EXPECT_EQ(translation_x(handle.motion), 2);
  EXPECT_EQ(sent.update.settings.region->vertices.size(), 4u);
}

TEST(Ledger, ARemovalWinsOverWhatWaits) {
  Ledger ledger;
  ledger.add(adding("tip", {7}));
  ledger.add(removing("tip"));
  const NumberedUpdate sent = ledger.send_next();
  EXPECT_TRUE(std::holds_alternative<Update::Removal>(sent.update.handles.at("tip")));
}

TEST(Ledger, SendsNoMoreThanItsWindowAtOnce) {
  Ledger ledger;
  for (std::size_t k = 0; k < Ledger::kWindow; ++k) {
    ledger.add(with_p(2));
    ASSERT_TRUE(ledger.can_send());
    ledger.send_next();
  }
  ledger.add(with_p(3));
  EXPECT_FALSE(ledger.can_send());
  ledger.accept(1);
  EXPECT_TRUE(ledger.can_send());
}

TEST(Ledger, SendsAgainWhatALostConnectionLeftUnanswered) {
  Ledger ledger;
  ledger.add(adding("tip", {7}));
  ledger.send_next();
  ledger.add(moving("tip", 3));
  ledger.connection_lost();
  EXPECT_FALSE(ledger.has_in_flight());
  const NumberedUpdate again = ledger.send_next();
  EXPECT_EQ(again.seq, 2u);
  EXPECT_EQ(translation_x(std::get<Handle>(again.update.handles.at("tip")).motion), 3);
}

TEST(Ledger, RestoresALostSessionFromWhatWasAcceptedAlone) {
  Ledger ledger;
  ledger.add(adding("base", {1}));
  ledger.add(adding("tip", {7}));
  ledger.accept(ledger.send_next().seq);
  ledger.add(moving("tip", 5));
  ledger.accept(ledger.send_next().seq);
  ledger.add(removing("base"));
  ledger.accept(ledger.send_next().seq);
  ledger.add(adding("bad", {999}));
  ledger.send_next();

  ledger.session_lost();
  ASSERT_TRUE(ledger.has_restore());
  const NumberedUpdate restore = ledger.send_next();
  EXPECT_EQ(restore.seq, 4u);
  ASSERT_EQ(restore.update.handles.size(), 1u);
  EXPECT_EQ(translation_x(std::get<Handle>(restore.update.handles.at("tip")).motion), 5);

  const NumberedUpdate unanswered = ledger.send_next();
  EXPECT_EQ(unanswered.seq, 5u);
  EXPECT_TRUE(unanswered.update.handles.contains("bad"));
}

TEST(Ledger, KeepsARestoreApartWhenTheConnectionIsLostAgain) {
  Ledger ledger;
  ledger.add(adding("tip", {7}));
  ledger.accept(ledger.send_next().seq);
  ledger.session_lost();
  ledger.send_next();
  ledger.add(with_p(6));
  ledger.connection_lost();
  ASSERT_TRUE(ledger.has_restore());
  EXPECT_FALSE(ledger.send_next().update.settings.p.has_value());
  EXPECT_TRUE(ledger.send_next().update.settings.p.has_value());
}

TEST(Ledger, ForgetsWhatWasRefused) {
  Ledger ledger;
  ledger.add(adding("tip", {7}));
  ledger.accept(ledger.send_next().seq);
  ledger.add(with_p(0.5));
  ledger.refuse(ledger.send_next().seq);
  EXPECT_EQ(ledger.newest(), 1u);
  ledger.session_lost();
  EXPECT_FALSE(ledger.send_next().update.settings.p.has_value());
}

TEST(Ledger, CountsOnFromWhatTheServerKnows) {
  Ledger ledger;
  ledger.add(with_p(2));
  ledger.count_from(41);
  EXPECT_EQ(ledger.send_next().seq, 42u);
  EXPECT_EQ(ledger.add(with_p(3)), 43u);
  ledger.count_from(10);
  EXPECT_EQ(ledger.add(with_p(3)), 44u);
}

/// Taken by the server at once.
void take(Ledger& ledger, Update update, bool is_kept) {
  ledger.add(std::move(update));
  ledger.accept(ledger.send_next().seq, is_kept);
}

TEST(Ledger, SendsAgainWhatWasTakenAndNotKeptWhereTheServerWentBack) {
  Ledger ledger;
  take(ledger, adding("tip", {7}), true);
  take(ledger, removing("old"), false);
  take(ledger, moving("tip", 5), false);
  ledger.resumed_at(3);
  EXPECT_FALSE(ledger.has_waiting());
  ledger.resumed_at(1);
  ASSERT_TRUE(ledger.has_restore());
  const NumberedUpdate sent = ledger.send_next();
  EXPECT_EQ(sent.seq, 3u);
  EXPECT_TRUE(std::holds_alternative<Update::Removal>(sent.update.handles.at("old")));
  EXPECT_EQ(translation_x(std::get<Motion>(sent.update.handles.at("tip"))), 5);
  ledger.connection_lost();  // before it was answered: it stays on its own
  ASSERT_TRUE(ledger.has_restore());
  ledger.accept(ledger.send_next().seq, true);
  ledger.resumed_at(1);
  EXPECT_FALSE(ledger.has_waiting());
}

TEST(Ledger, WhatWasNotKeptIsVoidOnceAnotherWriterTookOver) {
  Ledger ledger;
  take(ledger, adding("tip", {7}), true);
  take(ledger, moving("tip", 5), false);
  ledger.drop_unaccepted();
  ledger.count_from(1);  // the server lost it, and the other writer changed nothing
  ledger.resumed_at(1);
  EXPECT_FALSE(ledger.has_waiting());
}

TEST(Ledger, AKeptUpdateKeepsAllThatWereTakenBeforeItAndNotThoseAfter) {
  Ledger ledger;
  take(ledger, adding("tip", {7}), false);
  ledger.add(moving("tip", 1));
  const std::uint64_t first = ledger.send_next().seq;
  ledger.add(moving("tip", 2));
  const std::uint64_t second = ledger.send_next().seq;
  ledger.accept(second, false);
  ledger.accept(first, true);
  ledger.resumed_at(first);
  EXPECT_TRUE(ledger.has_restore());
}

TEST(Ledger, AChangeThatTheServerMadeIsPartOfWhatItHasAccepted) {
  Ledger ledger;
  take(ledger, adding("tip", {7}), true);
  const std::uint64_t seq = ledger.take_number();
  ledger.accept_change({seq, removing("tip")}, true);
  EXPECT_EQ(ledger.newest(), seq);
  EXPECT_EQ(ledger.add(moving("base", 1)), seq + 1);
  ledger.session_lost();
  EXPECT_TRUE(ledger.send_next().update.handles.empty());
}

TEST(Ledger, OfASessionThatIsMadeWithHandlesItKeepsWhatBecameOfThem) {
  Ledger ledger(false);
  take(ledger, moving("tip", 1), false);
  take(ledger, moving("tip", 2), false);
  take(ledger, removing("base"), false);
  ledger.session_lost();
  ASSERT_TRUE(ledger.has_restore());
  const Update again = ledger.send_next().update;
  EXPECT_EQ(again.handles.size(), 2u);
  EXPECT_EQ(translation_x(std::get<Motion>(again.handles.at("tip"))), 2);
  EXPECT_TRUE(std::holds_alternative<Update::Removal>(again.handles.at("base")));
}

}  // namespace
}  // namespace lpdeform::client
