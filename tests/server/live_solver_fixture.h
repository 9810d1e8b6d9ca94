#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bar.h"
#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/live_solver.h"

namespace lpdeform {

inline constexpr int kMostSlices = 100000;

class LiveSolverTest : public testing::Test {
 protected:
  explicit LiveSolverTest(const TriangleMesh& mesh = bar_mesh())
      : shape_(shape_of(mesh)),
        mailbox_(shape_),
        solver_(deformer_of(shape_), mailbox_, *publisher_, std::make_shared<DrawMesh>(shape_),
                {timers_, [this] { ++rings_; }}, {}) {}

  const Points& rest() const { return shape_->positions(); }

  std::shared_ptr<FrameStream> look_on(bool with_certificate = false) {
    auto stream =
        std::make_shared<FrameStream>(StreamOptions{.credit = 8, .with_certificate = with_certificate},
                                      publisher_, timers_, std::chrono::seconds(15), OpenedNote{});
    EXPECT_TRUE(publisher_->add(stream));
    return stream;
  }

  void settle(SolveJob* job = nullptr) {
    int slices = 0;
    while (solver_.run_slice(job)) ASSERT_LT(++slices, kMostSlices);
  }

  std::shared_ptr<SolveJob> job(SolveOptions options = {}) {
    auto made = std::make_shared<SolveJob>(
        std::move(options), [this](const SolveProgress&) { ++reports_; },
        [this](absl::StatusOr<SolveResult> result) { result_ = std::move(result); });
    made->version = mailbox_.newest().version;
    return made;
  }

  std::string failure() const { return result_ ? fault_of(result_->status()).reason : "not ended"; }

  std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  std::shared_ptr<Publisher> publisher_ = std::make_shared<Publisher>();
  std::shared_ptr<const RestShape> shape_;
  Mailbox mailbox_;
  LiveSolver solver_;
  std::optional<absl::StatusOr<SolveResult>> result_;
  int reports_ = 0;
  int rings_ = 0;
};

}  // namespace lpdeform
