// TakeBetterShape, and the notice that comes before it.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "service_fixture.h"

namespace lpdeform {
namespace {

class BetterShapeCallTest : public ServiceTest {
 protected:
  BetterShapeCallTest() { timers_ = std::make_shared<ManualTimers>(); }

  /// A bar that is bent by 80 degrees. At p = 1.5 its first minimum is 2.8 % above the lowest one known.
  v1::Update bend() const {
    v1::Update update = ends_message(mesh_.vertices, 1, 0);
    v1::RigidMotion& turn = *update.mutable_handles(1)->mutable_set()->mutable_motion()->mutable_rigid();
    turn.mutable_axis()->set_x(1);
    turn.set_angle_radians(80 * std::numbers::pi / 180);
    turn.mutable_center()->set_x(3);
    turn.mutable_center()->set_y(3);
    turn.mutable_center()->set_z(20);
    update.mutable_settings()->mutable_p()->set_uniform(1.5);
    return update;
  }

  grpc::Status take(const std::string& session, const std::string& writer_token) {
    v1::TakeBetterShapeRequest request;
    request.set_session(session);
    request.set_writer_token(writer_token);
    grpc::ClientContext context;
    return stub_->TakeBetterShape(&context, request, &taken_);
  }

  std::string refusal(const std::string& session, const std::string& writer_token) {
    return details_of(take(session, writer_token)).info.reason();
  }

  const TriangleMesh mesh_ = box_surface(6, 6, 40);
  v1::TakeBetterShapeResponse taken_;
};

TEST_F(BetterShapeCallTest, TheWriterTakesWhatANoticeHasAnnounced) {
  const auto session = create(mesh_);
  const std::string& name = session.session().name();
  DeformClient stream(*stub_, session);
  ASSERT_TRUE(stream.send(bend()));
  const auto result = stream.settle(1);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(refusal(name, session.writer_token()), "NO_BETTER_SHAPE");
  v1::Notice notice;
  {
    const SlowClock clock(*timers_, LiveSolver::kSearchQuiet);  // a server that has much to do searches later
    while (notice.reason() != v1::NOTICE_REASON_BETTER_SHAPE) {
      const auto message = stream.read();
      ASSERT_TRUE(message.has_value());
      notice = message->event().notice();
    }
  }
  EXPECT_EQ(notice.input_seq(), 1u);
  EXPECT_GT(notice.saved_share(), 0.02);

  EXPECT_EQ(refusal(name, "wrong"), "NOT_THE_WRITER");
  EXPECT_EQ(refusal(name, ""), "WRITER_TOKEN_MISSING");
  EXPECT_EQ(refusal("sessions/none", session.writer_token()), "SESSION_UNKNOWN");
  ASSERT_TRUE(take(name, session.writer_token()).ok());
  EXPECT_EQ(taken_.input_seq(), 1u);
  EXPECT_EQ(taken_.energy(), notice.energy());
  const auto shown = stream.next_frame();
  ASSERT_TRUE(shown.has_value());
  EXPECT_TRUE(shown->header.is_final());
  EXPECT_EQ(shown->header.input_seq(), 1u);
  EXPECT_EQ(shown->header.energy(), notice.energy());
  EXPECT_NE(shown->positions, result->positions);
  EXPECT_EQ(refusal(name, session.writer_token()), "NO_BETTER_SHAPE");
}

}  // namespace
}  // namespace lpdeform
