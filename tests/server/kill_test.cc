// The program with a store, killed at random moments of a random schedule and restarted: everything that it reported as stored
// is there and can be solved. LPDEFORM_KILLS and LPDEFORM_SEED choose how often, and which schedule.

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "program.h"
#include "redis_server.h"
#include "service_fixture.h"

namespace lpdeform {
namespace {

using Clock = std::chrono::steady_clock;

/// What a store and a server's address are called.
struct Places {
  std::string address, store;
};

int number_from_environment(const char* name, int otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

/// A value that may be seen: any that was sent after the last one that was kept, or that one.
class Possible {
 public:
  explicit Possible(double at_first) : values_{{0, at_first}} {}

  void sent(std::uint64_t seq, double value) { values_[seq] = value; }
  void kept(std::uint64_t seq) {
    const auto found = values_.find(seq);
    if (found != values_.end() && seq >= kept_) values_.erase(values_.begin(), found);
    kept_ = std::max(kept_, seq);
  }
  bool may_be(double value) const {
    for (const auto& [seq, possible] : values_) {
      if (std::abs(possible - value) < 1e-12) return true;
    }
    return false;
  }

 private:
  std::map<std::uint64_t, double> values_;
  std::uint64_t kept_ = 0;
};

/// One session and its writer, on a thread of its own: sends what its seed says, and goes on after each kill.
class Writer {
 public:
  Writer(const Places& places, unsigned seed) : places_(places), seed_(seed), chance_(seed) {}

  void run(const std::atomic<bool>& is_over) {
    while (!is_over) {
      const auto stub = connect();
      if (!is_made_ && !make(*stub)) continue;
      act(*stub);
    }
  }

  /// What the server has now. Counts what is missing.
  void check() {
    if (!is_made_) return;
    const auto stub = connect();
    v1::GetSessionRequest get;
    get.set_session(session_.session().name());
    v1::GetSessionResponse got;
    const grpc::Status found =
        patiently([&](grpc::ClientContext& context) { return stub->GetSession(&context, get, &got); });
    ASSERT_TRUE(found.ok()) << found.error_message();
    lost_ += got.session().input_seq() < kept_seq_ ? 1 : 0;
    lost_ += got.session().epoch() <= epoch_ ? 1 : 0;  // frames begin again at 1
    epoch_ = got.session().epoch();
    if (p_seq_ > 0) lost_ += p_.may_be(got.session().settings().p().uniform()) ? 0 : 1;
    check_positions(*stub);
  }

  std::uint64_t acknowledged() const { return acknowledged_; }
  std::uint64_t sent() const { return sent_; }
  int lost() const { return lost_; }

 private:
  std::unique_ptr<v1::DeformService::Stub> connect() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    return v1::DeformService::NewStub(
        grpc::CreateCustomChannel(places_.address, grpc::InsecureChannelCredentials(), arguments));
  }

  /// Until the server is there, and has released what the one before it held.
  template <typename Call>
  static grpc::Status patiently(const Call& call) {
    const auto end = std::chrono::system_clock::now() + kTestDeadline;
    grpc::Status status;
    do {
      grpc::ClientContext context;
      context.set_wait_for_ready(true);
      context.set_deadline(end);
      status = call(context);
    } while (status.error_code() == grpc::StatusCode::UNAVAILABLE && std::chrono::system_clock::now() < end);
    return status;
  }

  bool make(v1::DeformService::Stub& stub) {
    v1::CreateSessionRequest request;
    request.set_request_id(absl::StrCat("a writer of seed ", seed_));
    *request.mutable_mesh() = mesh_message(mesh_);
    const grpc::Status made = patiently(
        [&](grpc::ClientContext& context) { return stub.CreateSession(&context, request, &session_); });
    is_made_ = made.ok();
    return is_made_;
  }

  /// Up to eight updates, in one of the ways that there are; returns after them, or when the server has died.
  void act(v1::DeformService::Stub& stub) {
    if (chance_() % 2 == 0) return send_on_a_stream(stub);
    for (int k = 0; k < 8; ++k) {
      v1::UpdateHandlesRequest request;
      request.set_session(session_.session().name());
      request.set_writer_token(session_.writer_token());
      *request.mutable_update() = next();
      v1::UpdateHandlesResponse response;
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
      if (!stub.UpdateHandles(&context, request, &response).ok()) return;
      answered(response.result());
    }
  }

  void send_on_a_stream(v1::DeformService::Stub& stub) {
    DeformClient stream(stub, session_);
    int awaited = 0;
    for (int k = 0; k < 8; ++k) awaited += stream.send(next()) ? 1 : 0;
    while (awaited > 0) {
      const auto response = stream.read();
      if (!response) return;
      if (response->has_result()) answered(response->result());
      if (response->has_result() || response->event().has_fault()) --awaited;
    }
  }

  v1::Update next() {
    const std::uint64_t seq = ++sent_;
    const double x = 1e-3 * static_cast<double>(seq);
    v1::Update update;
    if (seq == 1) {
      set_handle(update, "base", vertices_at(mesh_.vertices, 0), 0);
      set_handle(update, "tip", vertices_at(mesh_.vertices, highest_z(mesh_.vertices)), x);
      tip_.sent(seq, x);
    } else if (chance_() % 8 == 0) {
      update.mutable_settings()->mutable_p()->set_uniform(1 + x);
      p_.sent(seq, 1 + x);
      p_seq_ = seq;
      of_p_.insert(seq);
    } else if (chance_() % 8 == 0) {
      set_handle(update, "tip", vertices_at(mesh_.vertices, highest_z(mesh_.vertices)), x);
      tip_.sent(seq, x);
    } else {
      move_handle(update, "tip", x);
      tip_.sent(seq, x);
    }
    update.set_input_seq(seq);
    return update;
  }

  void answered(const v1::UpdateResult& result) {
    if (!result.kept()) return;
    ++acknowledged_;
    kept_seq_ = std::max(kept_seq_, result.input_seq());
    (of_p_.contains(result.input_seq()) ? p_ : tip_).kept(result.input_seq());
  }

  /// The tip is where the newest value that was kept has it, or a later one.
  void check_positions(v1::DeformService::Stub& stub) {
    if (kept_seq_ == 0) return;
    v1::SolveRequest request;
    request.set_session(session_.session().name());
    request.set_writer_token(session_.writer_token());
    request.set_scalar(v1::SCALAR_FLOAT64);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    const auto reader = stub.Solve(&context, request);
    v1::SolveResponse response;
    FrameAssembler assembler;
    std::optional<ReceivedFrame> frame;
    while (reader->Read(&response)) {
      if (response.has_frame()) frame = assembler.add(response.frame());
    }
    const grpc::Status status = reader->Finish();
    ASSERT_TRUE(status.ok() && frame) << status.error_message();
    const auto tip = static_cast<std::size_t>(vertices_at(mesh_.vertices, highest_z(mesh_.vertices))[0]);
    const double x = frame->position<double>(tip, 0) - mesh_.vertices(static_cast<Eigen::Index>(tip), 0);
    lost_ += tip_.may_be(x) ? 0 : 1;
  }

  const Places places_;
  const TriangleMesh mesh_ = bar_mesh();
  const unsigned seed_;
  std::minstd_rand chance_;
  v1::CreateSessionResponse session_;
  bool is_made_ = false;
  std::uint64_t sent_ = 0, acknowledged_ = 0, kept_seq_ = 0, epoch_ = 0, p_seq_ = 0;
  std::set<std::uint64_t> of_p_;  // those of the updates that set p
  Possible tip_{0}, p_{2};
  int lost_ = 0;
};

class KillTest : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Stores, KillTest, testing::Values("sqlite", "redis"),
                         [](const auto& info) { return info.param; });

TEST_P(KillTest, NoAcknowledgedUpdateIsLostAndNothingIsCorrupted) {
  const int kills = number_from_environment("LPDEFORM_KILLS", 6);
  const auto seed = static_cast<unsigned>(number_from_environment("LPDEFORM_SEED", 1));
  char folder[] = "/tmp/lpdeform-kill-XXXXXX";
  ASSERT_NE(mkdtemp(folder), nullptr);
  const bool has_redis = GetParam() == "redis";
  const std::unique_ptr<RedisServer> redis = has_redis ? std::make_unique<RedisServer>(folder) : nullptr;
  const Places places{absl::StrCat("unix:", folder, "/socket"),
                      has_redis ? absl::StrCat("redis://127.0.0.1:", redis->port())
                                : absl::StrCat("sqlite:", folder, "/store")};
  const auto start = [&] {
    std::filesystem::remove(absl::StrCat(folder, "/socket"));
    return std::make_unique<Program>(std::vector<std::string>{"--address", places.address, "--store",
                                                              places.store, "--log-level", "warning"});
  };

  std::minstd_rand chance(seed);
  std::vector<std::unique_ptr<Writer>> writers;
  for (unsigned k = 0; k < 3; ++k) writers.push_back(std::make_unique<Writer>(places, seed * 100 + k));
  for (int kill = 0; kill < kills; ++kill) {
    auto server = start();
    ASSERT_FALSE(server->address().empty());
    for (const auto& writer : writers) writer->check();
    std::atomic<bool> is_over = false;
    std::vector<std::thread> threads;
    for (const auto& writer : writers) threads.emplace_back([&] { writer->run(is_over); });
    const Clock::time_point at = Clock::now() + std::chrono::milliseconds(20 + chance() % 400);
    std::this_thread::sleep_until(at);  // a random moment, which no event tells of
    is_over = true;
    if (has_redis && kill % 2 == 1) redis->stop();
    server->signal(SIGKILL);
    server->wait();
    server.reset();
    if (has_redis && kill % 2 == 1) redis->start();
    // Those that wait for a server to be there get one.
    auto again = start();
    for (std::thread& thread : threads) thread.join();
    again->signal(SIGKILL);
    again->wait();
  }
  auto server = start();
  ASSERT_FALSE(server->address().empty());
  std::uint64_t acknowledged = 0, sent = 0;
  int lost = 0;
  for (const auto& writer : writers) {
    writer->check();
    acknowledged += writer->acknowledged();
    sent += writer->sent();
    lost += writer->lost();
  }
  server->signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0);
  std::printf("kills: %d, updates sent: %llu, acknowledged as kept: %llu, lost: %d (seed %u)\n", 2 * kills,
              static_cast<unsigned long long>(sent), static_cast<unsigned long long>(acknowledged), lost,
              seed);
  EXPECT_EQ(lost, 0);
  EXPECT_GT(acknowledged, static_cast<std::uint64_t>(kills));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace lpdeform
