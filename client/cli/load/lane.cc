#include "client/cli/load/lane.h"

#include <cmath>
#include <utility>

#include "client/cli/files/mesh_input.h"
#include "core/base/fault.h"
#include "core/shapes/shapes.h"

namespace lpdeform::cli {
namespace {

constexpr std::chrono::minutes kSetupPatience{10};
constexpr std::chrono::milliseconds kReadPatience{200};
constexpr double kMovesACircle = 64;

std::uint64_t microseconds(Lane::Clock::duration duration) {
  const auto count = std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
  return count > 0 ? static_cast<std::uint64_t>(count) : 0;
}

/// A square sheet with about this many vertices.
TriangleMesh sheet(int vertices) {
  const int side = std::max(1, static_cast<int>(std::lround(std::sqrt(vertices))) - 1);
  return grid(side, side, 0.2);
}

std::vector<std::uint32_t> edge_at(const Points& points, double x) {
  std::vector<std::uint32_t> edge;
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    if (points(v, 0) == x) edge.push_back(static_cast<std::uint32_t>(v));
  }
  return edge;
}

client::RigidMotion lifted(double size, std::uint64_t moves) {
  return {
      .translation = {0, 0, 0.3 * size * std::sin(2 * M_PI * static_cast<double>(moves) / kMovesACircle)}};
}

client::Update beginning(const Points& points, double p) {
  client::Update update;
  const double end = points.col(0).maxCoeff();
  update.handles.emplace("base", client::Handle{.vertices = edge_at(points, 0)});
  update.handles.emplace("tip", client::Handle{.vertices = edge_at(points, end), .motion = lifted(end, 1)});
  update.settings.p = p;
  return update;
}

}  // namespace

void LoadTally::add(const LoadTally& other) {
  latency.add(other.latency);
  setup.add(other.setup);
  due += other.due;
  unanswered += other.unanswered;
  frames += other.frames;
  skipped += other.skipped;
  stale += other.stale;
  payload_bytes += other.payload_bytes;
  reconnects += other.reconnects;
  for (const auto& [reason, count] : other.errors) errors[reason] += count;
}

absl::StatusOr<std::unique_ptr<Lane>> Lane::open(const Connect& connect, int vertices, double p) {
  const TriangleMesh mesh = sheet(vertices);
  std::unique_ptr<Lane> lane(new Lane(connect, static_cast<int>(mesh.vertices.rows())));
  const Clock::time_point begin = Clock::now();
  auto client = connect();
  if (!client.ok()) return client.status();
  auto session = client->open(to_client(mesh));
  if (!session.ok()) return session.status();
  lane->owner_ = *std::move(session);
  auto driver = lane->join();
  if (!driver.ok()) return driver.status();
  if (const auto sent = (*driver)->update(beginning(mesh.vertices, p)); !sent.ok()) return sent.status();
  const auto settled = (*driver)->settle(kSetupPatience);
  if (!settled.ok()) return settled.status();
  lane->tally_.setup.record(microseconds(Clock::now() - begin));
  lane->driver_ = *std::move(driver);
  lane->reader_ = std::thread([self = lane.get()] { self->read(); });
  return lane;
}

Lane::~Lane() {
  finish();
  driver_.reset();
  if (owner_) owner_->close().IgnoreError();
}

absl::StatusOr<std::shared_ptr<client::Session>> Lane::join() {
  auto client = connect_();
  if (!client.ok()) return client.status();
  auto session = client->join(owner_->name(), client::Role::kWriter);
  if (!session.ok()) return session.status();
  return std::make_shared<client::Session>(*std::move(session));
}

std::shared_ptr<client::Session> Lane::driver() const {
  const std::scoped_lock lock(mutex_);
  return driver_;
}

void Lane::move(Clock::time_point due) {
  const std::scoped_lock lock(mutex_);
  if (is_over_) return;
  ++tally_.due;
  // Under the lock, so that no frame is examined between sending the update and noting it.
  const auto sent = driver_->move("tip", lifted(std::sqrt(vertices_), ++moves_ + 1));
  if (sent.ok()) {
    newest_seq_ = *sent;
    pending_.push_back({*sent, due});
  } else if (is_reconnecting_) {
    pending_.push_back({newest_seq_ + 1, due});  // counts as the first update of the new connection
  } else {
    ++tally_.errors[fault_of(sent.status()).reason];
    ++tally_.unanswered;
  }
}

void Lane::read() {
  for (;;) {
    const auto driver = this->driver();
    const absl::StatusOr<client::Frame> frame = driver->next_frame(kReadPatience);
    if (frame.ok()) take(*frame);
    std::unique_lock lock(mutex_);
    if (is_over_) return;
    if (frame.ok() || absl::IsDeadlineExceeded(frame.status()) || driver != driver_ || is_reconnecting_) {
      continue;
    }
    ++tally_.errors[fault_of(frame.status()).reason];
    changed_.wait_for(lock, kReadPatience,
                      [&] { return is_over_; });  // a call that has failed may fail again at once
  }
}

void Lane::take(const client::Frame& frame) {
  const Clock::time_point now = Clock::now();
  const std::scoped_lock lock(mutex_);
  ++tally_.frames;
  tally_.skipped += frame.skipped_inputs;
  if (frame.input_seq < newest_seq_) ++tally_.stale;
  tally_.payload_bytes += sizeof(float) * (frame.positions.size() + frame.distortion.size());
  while (!pending_.empty() && pending_.front().input_seq <= frame.input_seq) {
    tally_.latency.record(microseconds(now - pending_.front().due));
    pending_.pop_front();
  }
}

void Lane::add_slow_reader(std::chrono::milliseconds pause) {
  auto client = connect_();
  if (!client.ok()) return note(client.status());
  auto session = client->join(owner_->name(), client::Role::kReader);
  if (!session.ok()) return note(session.status());
  slow_reader_ = std::thread([this, pause](client::Session reader) { read_slowly(std::move(reader), pause); },
                             *std::move(session));
}

void Lane::read_slowly(client::Session session, std::chrono::milliseconds pause) {
  for (;;) {
    const auto frame = session.next_frame(kReadPatience);
    if (!frame.ok() && !absl::IsDeadlineExceeded(frame.status())) note(frame.status());
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, pause, [this] { return is_over_; })) return;
  }
}

void Lane::reconnect() {
  {
    const std::scoped_lock lock(mutex_);
    is_reconnecting_ = true;
  }
  auto joined = join();
  if (!joined.ok()) note(joined.status());
  // Destroyed after the lock is released, because it sends a farewell to the server.
  std::shared_ptr<client::Session> before;
  const std::scoped_lock lock(mutex_);
  is_reconnecting_ = false;
  if (!joined.ok()) return;
  before = std::exchange(driver_, *std::move(joined));
  ++tally_.reconnects;
}

void Lane::note(const absl::Status& error) {
  const std::scoped_lock lock(mutex_);
  ++tally_.errors[fault_of(error).reason];
}

bool Lane::is_answered() const {
  const std::scoped_lock lock(mutex_);
  return pending_.empty();
}

LoadTally Lane::finish() {
  {
    const std::scoped_lock lock(mutex_);
    if (!is_over_) tally_.unanswered += pending_.size();
    is_over_ = true;
  }
  changed_.notify_all();
  if (reader_.joinable()) reader_.join();
  if (slow_reader_.joinable()) slow_reader_.join();
  return tally_;
}

}  // namespace lpdeform::cli
