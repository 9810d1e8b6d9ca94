#include "server/session/session.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <functional>
#include <future>
#include <latch>
#include <mutex>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "bar.h"
#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/session/registry.h"

namespace lpdeform {
namespace {

std::string reason(const absl::Status& status) {
  return fault_of(status).reason;
}

/// Reads a stream as a client would, acknowledging every frame; lets a test wait for what it is told.
class Reader {
 public:
  explicit Reader(std::shared_ptr<FrameStream> stream) : state_(std::make_shared<State>()) {
    state_->stream = std::move(stream);
    state_->stream->start([weak = std::weak_ptr(state_)] {
      if (const auto state = weak.lock()) state->pump();
    });
    state_->pump();
  }

  /// The last frame so far that `is_wanted` likes, or the next one.
  template <typename Predicate>
  std::shared_ptr<const Frame> wait_for_frame(Predicate is_wanted) {
    std::unique_lock lock(state_->mutex);
    std::shared_ptr<const Frame> found;
    const bool came = state_->changed.wait_for(lock, std::chrono::seconds(60), [&] {
      for (const auto& frame : state_->frames) {
        if (is_wanted(*frame)) found = frame;
      }
      return found != nullptr;
    });
    EXPECT_TRUE(came);
    return found;
  }

  std::optional<EndNote> wait_for_end() { return wait_for(state_->end); }
  std::optional<BetterNote> wait_for_better() { return wait_for(state_->better); }

 private:
  template <typename Value>
  std::optional<Value> wait_for(const std::optional<Value>& value) {
    std::unique_lock lock(state_->mutex);
    state_->changed.wait_for(lock, std::chrono::seconds(60), [&] { return value.has_value(); });
    return value;
  }

  struct State {
    void pump() {
      const std::scoped_lock one_at_a_time(pumping);
      while (const auto note = stream->next()) {
        std::uint64_t received = 0;
        {
          const std::scoped_lock lock(mutex);
          const auto* const piece = std::get_if<FramePiece>(&*note);
          if (piece != nullptr && piece->is_last) {
            frames.push_back(piece->frame);
            received = piece->frame->frame_seq;
          }
          if (const auto* const note_end = std::get_if<EndNote>(&*note)) end = *note_end;
          if (const auto* const note_better = std::get_if<BetterNote>(&*note)) better = *note_better;
        }
        changed.notify_all();
        if (received != 0) stream->acknowledge(received).IgnoreError();
      }
    }

    std::shared_ptr<FrameStream> stream;
    std::recursive_mutex pumping;
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::shared_ptr<const Frame>> frames;
    std::optional<EndNote> end;
    std::optional<BetterNote> better;
  };
  std::shared_ptr<State> state_;
};

/// Takes a thread of the scheduler.
class Blocker final : public Runnable {
 public:
  explicit Blocker(std::function<void()> block) : Runnable(false), block_(std::move(block)) {}
  bool run() override {
    block_();
    return false;
  }

 private:
  const std::function<void()> block_;
};

class SessionTest : public testing::Test {
 protected:
  ~SessionTest() override { registry_->clear(EndReason::kDraining, ""); }

  std::shared_ptr<Session> create(const std::string& request_id = "", const TriangleMesh& mesh = bar_mesh()) {
    const auto shape = shape_of(mesh);
    SessionParts parts{.name = absl::StrCat("sessions/", ++count_),
                       .shape = shape,
                       .deformer = deformer_of(shape),
                       .free_components = FreeComponents::kError,
                       .beginning = {},
                       .memory = {}};
    auto session = Session::create(std::move(parts), {scheduler_, timers_, std::chrono::seconds(15)});
    EXPECT_TRUE(session.ok());
    const auto ignore = [](const absl::StatusOr<CreatedSession>&) {};
    EXPECT_TRUE(registry_->begin_creation(request_id, ignore));
    registry_->finish_creation(request_id, session, ignore);
    rest_ = shape->positions();
    return *session;
  }

  std::shared_ptr<FrameStream> open(Session& session, const std::string& token = "") {
    const auto writer = session.writer(token);
    auto stream =
        session.open_stream(writer.ok() ? std::make_optional(*writer) : std::nullopt, {.credit = 2});
    EXPECT_TRUE(stream.ok()) << stream.status();
    return *stream;
  }

  /// Keeps the scheduler from running anything until the latch is counted down.
  std::shared_ptr<std::latch> block() {
    const auto are_busy = std::make_shared<std::latch>(scheduler_.threads());
    auto release = std::make_shared<std::latch>(1);  // the others may wait for longer than the test lasts
    for (int k = 0; k < scheduler_.threads(); ++k) {
      scheduler_.wake(std::make_shared<Blocker>([are_busy, release] {
        are_busy->count_down();
        release->wait();
      }));
    }
    are_busy->wait();
    return release;
  }

  std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  Scheduler scheduler_{4};
  std::shared_ptr<Registry> registry_ =
      std::make_shared<Registry>(timers_, Registry::Limits{3, std::chrono::minutes(10)});
  int count_ = 0;
  Points rest_;
};

TEST_F(SessionTest, AnswersUpdatesOnEveryStream) {
  const auto session = create();
  const std::string token = session->lease().token;
  Reader writer(open(*session, token)), reader(open(*session));
  ASSERT_TRUE(session->update(session->writer(token), hold_ends(rest_, 1, 1)).ok());
  ASSERT_TRUE(session->update(session->writer(token), move_tip(2, 2)).ok());
  const auto is_answer = [](const Frame& frame) { return frame.input_seq == 2 && frame.is_final; };
  EXPECT_TRUE(writer.wait_for_frame(is_answer));
  EXPECT_TRUE(reader.wait_for_frame(is_answer));
}

TEST_F(SessionTest, AnUpdateAndAStepTakenBackAreAnsweredBeforeRefinements) {
  const auto session = create();
  const std::string token = session->lease().token;
  ASSERT_TRUE(session->update(session->writer(token), hold_ends(rest_, 1, 1)).ok());
  const auto release = block();
  EXPECT_FALSE(scheduler_.is_answer_waiting());
  EXPECT_TRUE(session->undo(session->writer(token), 2, false).ok());
  EXPECT_TRUE(scheduler_.is_answer_waiting());
  release->count_down();
}

/// A bar that is bent by 80 degrees, and what its search announces.
class BetterShapeTest : public SessionTest {
 protected:
  BetterShapeTest()
      : session_(create("", box_surface(6, 6, 40))),
        token_(session_->lease().token),
        reader_(open(*session_, token_)) {}

  Update bend(std::uint64_t input_seq) const {
    constexpr double kAngle = 80 * std::numbers::pi / 180;
    Update update = hold_ends(rest_, input_seq, 0);
    update.handles.back().change =
        Handle{vertices_at(rest_, highest_z(rest_)),
               RigidMotion{Eigen::Vector3d::UnitX(), kAngle, {3, 3, 20}, {0, 0, 0}}};
    update.settings.p = Field::Constant(1, 1.5);
    return update;
  }

  std::shared_ptr<const Frame> wait_for_result(std::uint64_t input_seq) {
    return reader_.wait_for_frame(
        [&](const Frame& frame) { return frame.input_seq == input_seq && frame.is_final; });
  }

  std::optional<BetterNote> search() {
    EXPECT_TRUE(session_->update(session_->writer(token_), bend(1)).ok());
    EXPECT_TRUE(wait_for_result(1));
    const SlowClock clock(*timers_, LiveSolver::kSearchQuiet);  // with much to do, it searches later
    return reader_.wait_for_better();
  }

  absl::StatusOr<BetterNote> take() { return session_->take_better(session_->writer(token_)); }

  const std::shared_ptr<Session> session_;
  const std::string token_;
  Reader reader_;
};

TEST_F(BetterShapeTest, OnlyTheWriterTakesItAndOnlyWhatWasAnnounced) {
  EXPECT_EQ(reason(take().status()), "NO_BETTER_SHAPE");
  const auto better = search();
  ASSERT_TRUE(better);
  EXPECT_EQ(reason(session_->take_better(session_->writer("")).status()), "WRITER_TOKEN_MISSING");
  EXPECT_EQ(reason(session_->take_better(session_->writer("wrong")).status()), "NOT_THE_WRITER");
  const auto taken = take();
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(taken->input_seq, 1u);
  EXPECT_EQ(taken->energy, better->energy);
  EXPECT_TRUE(reader_.wait_for_frame(
      [&](const Frame& frame) { return frame.is_final && frame.energy == better->energy; }));
  EXPECT_EQ(reason(take().status()), "NO_BETTER_SHAPE");
}

TEST_F(BetterShapeTest, AnUpdateRightAfterwardsGoesOnFromIt) {
  const auto better = search();
  ASSERT_TRUE(better);
  const auto release = block();
  EXPECT_TRUE(take().ok());
  EXPECT_TRUE(session_->update(session_->writer(token_), bend(2)).ok());
  EXPECT_EQ(reason(take().status()), "NO_BETTER_SHAPE");  // it is for the inputs before
  release->count_down();
  EXPECT_NEAR(wait_for_result(2)->energy, better->energy, 1e-3 * better->energy);
}

TEST_F(BetterShapeTest, AClosedSessionHasNone) {
  ASSERT_TRUE(search());
  registry_->remove(session_->name(), EndReason::kSessionDeleted, "gone");
  EXPECT_EQ(reason(take().status()), "SESSION_UNKNOWN");
}

TEST_F(SessionTest, OnlyTheWriterChangesIt) {
  const auto session = create();
  EXPECT_EQ(reason(session->update(session->writer(""), hold_ends(rest_, 1, 1)).status()),
            "WRITER_TOKEN_MISSING");
  EXPECT_TRUE(absl::IsUnauthenticated(session->update(session->writer(""), hold_ends(rest_, 1, 1)).status()));
  EXPECT_EQ(reason(session->update(session->writer("wrong"), hold_ends(rest_, 1, 1)).status()),
            "NOT_THE_WRITER");
  EXPECT_EQ(session->info().inputs.input_seq, 0u);
}

TEST_F(SessionTest, AnotherWriterEndsTheFirstOnesStreamAndTokenAndEpoch) {
  const auto session = create();
  const std::string first = session->lease().token;
  Reader writer(open(*session, first)), reader(open(*session));
  ASSERT_TRUE(session->update(session->writer(first), hold_ends(rest_, 7, 1)).ok());
  const auto shown_before = session->writer(first);
  const WriterLease second = session->acquire_writer();
  EXPECT_EQ(second.epoch, 2u);
  EXPECT_EQ(second.input_seq, 7u);
  const auto end = writer.wait_for_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->reason, EndReason::kWriterReplaced);
  EXPECT_EQ(reason(session->update(session->writer(first), move_tip(8, 1)).status()), "NOT_THE_WRITER");
  EXPECT_EQ(reason(session->update(shown_before, move_tip(8, 1)).status()), "NOT_THE_WRITER");
  EXPECT_EQ(reason(session->open_stream(*shown_before, {}).status()), "NOT_THE_WRITER");
  EXPECT_TRUE(session->update(session->writer(second.token), move_tip(8, 1)).ok());
  EXPECT_TRUE(
      reader.wait_for_frame([](const Frame& frame) { return frame.epoch == 2 && frame.input_seq == 8; }));
}

TEST_F(SessionTest, NoLockIsHeldWhileAReaderIsToldOfANewWriter) {
  const auto session = create();
  const auto reader = open(*session);
  std::atomic<std::uint64_t> epoch = 0;
  reader->start(
      [&] { epoch = session->lease().epoch; });  // as a call that ends does, under a lock of its own
  session->acquire_writer();
  EXPECT_EQ(epoch, 2u);
  reader->start([] {});
}

TEST_F(SessionTest, AnotherSolveOrWriterEndsASolveWithATypedError) {
  const auto session = create();
  const std::string token = session->lease().token;
  Update update = hold_ends(rest_, 1, 8);
  update.settings.solver = SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-13};
  std::promise<absl::Status> first, second;
  const auto job = [](std::promise<absl::Status>& ended) {
    return std::make_shared<SolveJob>(
        SolveOptions{}, nullptr,
        [&ended](const absl::StatusOr<SolveResult>& result) { ended.set_value(result.status()); });
  };
  ASSERT_TRUE(session->solve(session->writer(token), update, job(first)).ok());
  ASSERT_TRUE(session->solve(session->writer(token), std::nullopt, job(second)).ok());
  EXPECT_EQ(reason(first.get_future().get()), "SUPERSEDED");
  session->acquire_writer();
  EXPECT_EQ(reason(second.get_future().get()), "WRITER_REPLACED");
}

TEST_F(SessionTest, DeletionEndsStreamsAndSolvesWithTheirReason) {
  const auto session = create();
  const std::string token = session->lease().token;
  Reader reader(open(*session));
  Update update = hold_ends(rest_, 1, 8);
  update.settings.solver = SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-13};
  std::promise<absl::Status> ended;
  ASSERT_TRUE(session
                  ->solve(session->writer(token), update,
                          std::make_shared<SolveJob>(SolveOptions{}, nullptr,
                                                     [&](const absl::StatusOr<SolveResult>& result) {
                                                       ended.set_value(result.status());
                                                     }))
                  .ok());
  registry_->remove(session->name(), EndReason::kSessionDeleted, "gone");
  registry_->remove(session->name(), EndReason::kSessionDeleted, "gone");
  EXPECT_EQ(reason(ended.get_future().get()), "SESSION_DELETED");
  EXPECT_EQ(reader.wait_for_end()->reason, EndReason::kSessionDeleted);
  EXPECT_EQ(reason(session->update(session->writer(token), move_tip(2, 1)).status()), "SESSION_UNKNOWN");
  EXPECT_EQ(reason(session->open_stream(std::nullopt, {}).status()), "SESSION_UNKNOWN");
}

TEST_F(SessionTest, WhoHasHoldOfOneThatGoesOnElsewhereIsNotToldThatThereIsNone) {
  const auto session = create(), deleted = create();
  const std::string token = session->lease().token;
  const auto look = [&](const std::shared_ptr<Session>& one, const std::string& owner = "") {
    return reason(registry_->find(one->name(), owner).status());
  };
  ASSERT_TRUE(registry_->remove(*session, EndReason::kDraining, "Another server has it now."));
  EXPECT_EQ(reason(session->update(session->writer(token), {}).status()), "DRAINING");
  EXPECT_EQ(reason(session->undo(session->writer(token), 9, false).status()), "DRAINING");
  EXPECT_EQ(reason(session->solve(session->writer(token), std::nullopt,
                                  std::make_shared<SolveJob>(SolveOptions{}, nullptr, nullptr))),
            "DRAINING");
  EXPECT_EQ(reason(session->open_stream(*session->writer(token), {}).status()), "DRAINING");
  EXPECT_EQ(look(session), "SESSION_ELSEWHERE");
  EXPECT_EQ(look(session, "somebody else"), "SESSION_UNKNOWN");
  ASSERT_TRUE(registry_->remove(deleted->name(), EndReason::kSessionDeleted, ""));
  EXPECT_EQ(reason(deleted->update(deleted->writer(deleted->lease().token), {}).status()), "SESSION_UNKNOWN");
  EXPECT_EQ(look(deleted), "SESSION_UNKNOWN");
  registry_->forget_left(session->name());
  EXPECT_EQ(look(session), "SESSION_UNKNOWN");

  const auto other = create();
  ASSERT_TRUE(registry_->remove(*other, EndReason::kDraining, ""));
  timers_->advance(Registry::kLeaving);
  EXPECT_EQ(look(other), "SESSION_UNKNOWN");
}

TEST_F(SessionTest, RemovingOneLeavesAnotherOfItsNameThatCameBack) {
  const auto left = create();
  ASSERT_TRUE(registry_->remove(*left, EndReason::kDraining, ""));
  --count_;
  const auto back = create();
  ASSERT_EQ(back->name(), left->name());
  EXPECT_FALSE(registry_->remove(*left, EndReason::kDraining, ""));
  EXPECT_EQ(*registry_->find(back->name()), back);
  EXPECT_FALSE(back->is_closed());
}

TEST_F(SessionTest, ExpiresWhenNobodyUsesItAndAWatcherAloneIsNoUse) {
  const auto session = create();
  Reader reader(open(*session));
  timers_->advance(std::chrono::minutes(9));
  EXPECT_TRUE(registry_->find(session->name()).ok());
  timers_->advance(std::chrono::minutes(9));
  EXPECT_FALSE(session->is_closed());
  timers_->advance(std::chrono::minutes(1));
  EXPECT_TRUE(session->is_closed());
  EXPECT_EQ(reader.wait_for_end()->reason, EndReason::kSessionExpired);
  EXPECT_EQ(reason(registry_->find(session->name()).status()), "SESSION_UNKNOWN");
}

TEST_F(SessionTest, AcknowledgementsNameTheirStream) {
  const auto session = create();
  const auto stream = open(*session);
  EXPECT_EQ(reason(session->acknowledge("nobody", 1)), "STREAM_UNKNOWN");
  EXPECT_EQ(reason(session->acknowledge(stream->id(), 99)), "ACK_NOT_SENT");
  while (stream->next()) {
  }
  EXPECT_TRUE(session->acknowledge(stream->id(), 1).ok());
}

TEST_F(SessionTest, StreamsAreBounded) {
  const auto session = create();
  std::vector<std::shared_ptr<FrameStream>> streams;
  for (std::size_t k = 0; k < SessionLimits().streams; ++k) streams.push_back(open(*session));
  const auto refused = session->open_stream(std::nullopt, {});
  EXPECT_EQ(reason(refused.status()), "STREAMS_FULL");
  session->forget_stream(*streams[0]);
  EXPECT_TRUE(session->open_stream(std::nullopt, {}).ok());
}

TEST_F(SessionTest, TheRegistryHasRoomForSoManyAndSaysSo) {
  create();
  create();
  create("request-3");
  absl::Status refused;
  EXPECT_FALSE(registry_->begin_creation(
      "", [&](const absl::StatusOr<CreatedSession>& created) { refused = created.status(); }));
  EXPECT_EQ(reason(refused), "SESSIONS_FULL");
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
}

TEST_F(SessionTest, TheSameRequestIdGivesTheSameSessionAlsoWhileItIsBeingMade) {
  std::vector<absl::StatusOr<CreatedSession>> heard;
  const auto hear = [&](const absl::StatusOr<CreatedSession>& created) { heard.push_back(created); };
  ASSERT_TRUE(registry_->begin_creation("request-1", hear));
  EXPECT_FALSE(registry_->begin_creation("request-1", hear));
  EXPECT_TRUE(heard.empty());
  const auto session = create();
  registry_->finish_creation("request-1", session, hear);
  EXPECT_FALSE(registry_->begin_creation("request-1", hear));
  ASSERT_EQ(heard.size(), 3u);
  for (const auto& created : heard) {
    ASSERT_TRUE(created.ok());
    EXPECT_EQ(created->session, session);
    EXPECT_EQ(created->writer_token, session->lease().token);
  }
}

TEST_F(SessionTest, ARequestIdUsedForAnotherRequestIsRefused) {
  absl::Status heard;
  const auto hear = [&](const absl::StatusOr<CreatedSession>& created) { heard = created.status(); };
  ASSERT_TRUE(registry_->begin_creation("request-1", hear, 1));
  EXPECT_FALSE(registry_->begin_creation("request-1", hear, 2));
  EXPECT_EQ(reason(heard), "REQUEST_ID_REUSED");
}

TEST_F(SessionTest, AFailedCreationLeavesNothingBehind) {
  absl::Status heard;
  const auto hear = [&](const absl::StatusOr<CreatedSession>& created) { heard = created.status(); };
  ASSERT_TRUE(registry_->begin_creation("request-1", hear));
  registry_->finish_creation("request-1", absl::InvalidArgumentError("bad mesh"), hear);
  EXPECT_TRUE(absl::IsInvalidArgument(heard));
  EXPECT_TRUE(registry_->begin_creation("request-1", hear));
  registry_->finish_creation("request-1", absl::InvalidArgumentError("bad mesh"), hear);
  EXPECT_EQ(registry_->size(), 0u);
}

TEST_F(SessionTest, ListsNewestFirstPageByPage) {
  const auto a = create(), b = create(), c = create();
  const auto first = registry_->list(2, "");
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->sessions, (std::vector<std::shared_ptr<Session>>{c, b}));
  const auto second = registry_->list(2, first->next_page_token);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second->sessions, (std::vector<std::shared_ptr<Session>>{a}));
  EXPECT_EQ(second->next_page_token, "");
  EXPECT_EQ(reason(registry_->list(2, "nonsense").status()), "PAGE_TOKEN");
}

}  // namespace
}  // namespace lpdeform
