#include "client/cli/load_command.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/files/text_file.h"
#include "client/cli/interrupt.h"
#include "client/cli/load/lane.h"
#include "client/cli/progress.h"

namespace lpdeform::cli {
namespace {

using Clock = Lane::Clock;
using Lanes = std::vector<std::unique_ptr<Lane>>;
using Seconds = std::chrono::duration<double>;

/// How long to wait, after the last update, for outstanding frames.
constexpr std::chrono::seconds kLastPatience{10};
constexpr std::chrono::milliseconds kBetweenLooks{20};

Clock::duration clock_time(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
}

absl::StatusOr<Lanes> open_lanes(const LoadOptions& options, const Lane::Connect& connect,
                                 Progress& progress) {
  Lanes lanes;
  for (int k = 0; k < options.sessions; ++k) {
    progress.show(absl::StrCat("opening session ", k + 1, " of ", options.sessions));
    const auto kind = static_cast<std::size_t>(k) % options.vertices.size();
    auto lane = Lane::open(connect, options.vertices[kind], options.p);
    if (!lane.ok()) return lane.status();
    if (k < options.slow_readers) {
      (*lane)->add_slow_reader(std::chrono::milliseconds(std::llround(1000 * options.slow_pause_seconds)));
    }
    lanes.push_back(*std::move(lane));
  }
  return lanes;
}

/// Drops the lanes' connections in turn, each once per period, on a thread of its own because it waits for
/// the server.
class Reconnector {
 public:
  Reconnector(Lanes& lanes, double period_seconds) {
    if (period_seconds > 0)
      thread_ = std::thread([this, &lanes, period_seconds] { run(lanes, period_seconds); });
  }
  ~Reconnector() {
    {
      const std::scoped_lock lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run(Lanes& lanes, double period_seconds) {
    const Clock::time_point begin = Clock::now();
    const double step = period_seconds / static_cast<double>(lanes.size());
    for (std::size_t k = 0;; ++k) {
      {
        std::unique_lock lock(mutex_);
        const auto when = begin + clock_time(step * static_cast<double>(k + 1));
        if (changed_.wait_until(lock, when, [this] { return is_over_; })) return;
      }
      lanes[k % lanes.size()]->reconnect();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_over_ = false;
  std::thread thread_;
};

/// Sends each lane's updates when they are due, with the lanes spread over a period. Returns by how much the
/// latest update was late: if that is much, this machine could not keep up.
Clock::duration drive(const LoadOptions& options, Lanes& lanes, const Interrupt& interrupt,
                      Progress& progress) {
  const auto each = static_cast<std::uint64_t>(std::llround(options.rate * options.seconds));
  const std::uint64_t all = each * lanes.size();
  const double step = 1 / (options.rate * static_cast<double>(lanes.size()));
  const Clock::time_point begin = Clock::now();
  Clock::duration latest{};
  for (std::uint64_t k = 0; k < all && !interrupt.happened(); ++k) {
    const Clock::time_point due = begin + clock_time(step * static_cast<double>(k));
    std::this_thread::sleep_until(due);
    latest = std::max(latest, Clock::now() - due);
    lanes[k % lanes.size()]->move(due);
    if (k % 50 == 0) {
      progress.show(
          absl::StrFormat("%.0f of %.0f s, %d updates", Seconds(due - begin).count(), options.seconds, k));
    }
  }
  return latest;
}

void wait_for_answers(const Lanes& lanes) {
  const Clock::time_point end = Clock::now() + kLastPatience;
  const auto is_answered = [](const auto& lane) { return lane->is_answered(); };
  while (!std::all_of(lanes.begin(), lanes.end(), is_answered) && Clock::now() < end) {
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

double milliseconds(std::uint64_t microseconds) {
  return 1e-3 * static_cast<double>(microseconds);
}

nlohmann::ordered_json json_of(const Histogram& histogram) {
  nlohmann::ordered_json json;
  json["count"] = histogram.count();
  json["mean"] = 1e-3 * histogram.mean();
  for (const double percent : {50.0, 90.0, 95.0, 99.0, 99.9}) {
    json[absl::StrCat("p", percent)] = milliseconds(histogram.percentile(percent));
  }
  json["max"] = milliseconds(histogram.max());
  return json;
}

nlohmann::ordered_json json_of(const LoadTally& tally) {
  nlohmann::ordered_json json;
  json["updates"] = {
      {"due", tally.due}, {"answered", tally.latency.count()}, {"unanswered", tally.unanswered}};
  json["input_to_frame_ms"] = json_of(tally.latency);
  json["setup_ms"] = json_of(tally.setup);
  json["frames"] = {{"received", tally.frames}, {"skipped_inputs", tally.skipped}, {"stale", tally.stale}};
  json["payload_bytes"] = tally.payload_bytes;
  json["reconnects"] = tally.reconnects;
  json["errors"] = nlohmann::ordered_json::object();
  for (const auto& [reason, count] : tally.errors) json["errors"][reason] = count;
  return json;
}

void print(const std::string& name, const LoadTally& tally, double seconds) {
  const Histogram& latency = tally.latency;
  std::printf(
      "%-16s %8llu updates, %llu unanswered; input to frame p50 %.2f, p95 %.2f, p99 %.2f, max %.2f ms; "
      "%.1f frames/s, %llu inputs skipped, %.2f MB/s\n",
      name.c_str(), static_cast<unsigned long long>(tally.due),
      static_cast<unsigned long long>(tally.unanswered), milliseconds(latency.percentile(50)),
      milliseconds(latency.percentile(95)), milliseconds(latency.percentile(99)), milliseconds(latency.max()),
      static_cast<double>(tally.frames) / seconds, static_cast<unsigned long long>(tally.skipped),
      1e-6 * static_cast<double>(tally.payload_bytes) / seconds);
}

struct Outcome {
  LoadTally all;
  std::map<int, LoadTally> by_vertices;
  std::vector<std::uint64_t> frames;  // of each session
  double behind_ms = 0;
  double seconds = 0;
};

absl::Status write_report(const LoadOptions& options, const Outcome& outcome) {
  if (!options.report) return absl::OkStatus();
  nlohmann::ordered_json json;
  json["sessions"] = options.sessions;
  json["rate"] = options.rate;
  json["seconds"] = outcome.seconds;
  json["slow_readers"] = options.slow_readers;
  json["generator_behind_ms"] = outcome.behind_ms;
  const auto [least, most] = std::minmax_element(outcome.frames.begin(), outcome.frames.end());
  const double mean = static_cast<double>(outcome.all.frames) / static_cast<double>(outcome.frames.size());
  json["frames_per_session"] = {{"least", *least}, {"mean", mean}, {"most", *most}};
  json["all"] = json_of(outcome.all);
  json["all"]["input_to_frame_histogram_us"] = outcome.all.latency.buckets();
  for (const auto& [vertices, tally] : outcome.by_vertices)
    json["by_vertices"][std::to_string(vertices)] = json_of(tally);
  absl::Status written = write_text(*options.report, json.dump(1) + "\n");
  if (written.ok()) std::printf("wrote %s\n", options.report->c_str());
  return written;
}

Outcome run(const LoadOptions& options, Lanes& lanes, const Interrupt& interrupt, Progress& progress) {
  Outcome outcome;
  const Clock::time_point begin = Clock::now();
  {
    const Reconnector reconnector(lanes, options.reconnect_seconds);
    outcome.behind_ms = 1e3 * Seconds(drive(options, lanes, interrupt, progress)).count();
  }
  outcome.seconds = Seconds(Clock::now() - begin).count();
  progress.show("waiting for the last frames");
  wait_for_answers(lanes);
  for (const auto& lane : lanes) {
    const LoadTally tally = lane->finish();
    outcome.by_vertices[lane->vertices()].add(tally);
    outcome.all.add(tally);
    outcome.frames.push_back(tally.frames);
  }
  progress.show("deleting the sessions");
  lanes.clear();
  progress.clear();
  return outcome;
}

}  // namespace

ExitStatus run_load(const LoadOptions& options) {
  Interrupt interrupt;
  if (options.report) {
    if (absl::Status status = check_folder(*options.report); !status.ok()) return complain(status);
  }
  const auto connecting = client_options(options.server);
  if (!connecting.ok()) return complain(connecting.status());
  const Lane::Connect connect = [&] { return client::Client::connect(*options.server.address, *connecting); };
  Progress progress;
  auto lanes = open_lanes(options, connect, progress);
  progress.clear();
  if (!lanes.ok()) return complain(lanes.status());
  const Outcome outcome = run(options, *lanes, interrupt, progress);

  for (const auto& [vertices, tally] : outcome.by_vertices) {
    print(absl::StrCat(vertices, " vertices"), tally, outcome.seconds);
  }
  if (outcome.by_vertices.size() > 1) print("all", outcome.all, outcome.seconds);
  for (const auto& [reason, count] : outcome.all.errors)
    std::printf("error %s: %llu\n", reason.c_str(), static_cast<unsigned long long>(count));
  std::printf("sent at most %.2f ms late\n", outcome.behind_ms);
  if (absl::Status status = write_report(options, outcome); !status.ok()) return complain(status);
  if (interrupt.happened()) return kInterrupted;
  return outcome.all.unanswered == 0 && outcome.all.errors.empty() ? kDone : kShortOfTolerance;
}

}  // namespace lpdeform::cli
