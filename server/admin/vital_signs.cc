#include "server/admin/vital_signs.h"

#include <chrono>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

namespace lpdeform {
namespace {

using Bell = std::shared_ptr<std::promise<void>>;

bool rings(const Bell& bell) {
  const std::chrono::seconds patience(VitalSigns::kPatienceSeconds);
  return bell->get_future().wait_for(patience) == std::future_status::ready;
}

/// A slice as light as that of a small session.
class Probe final : public Runnable {
 public:
  explicit Probe(Bell bell) : Runnable(false), bell_(std::move(bell)) {}

  bool run() override {
    bell_->set_value();
    return false;
  }

 private:
  const Bell bell_;
};

}  // namespace

VitalSigns::Finding VitalSigns::examine() const {
  Finding finding;
  finding.is_draining = parts_.is_draining();
  const std::uint64_t refused = parts_.refused();
  if (!finding.is_draining) finding.takes_connections = parts_.accepts();
  finding.is_full = !finding.takes_connections && parts_.refused() != refused;
  finding.takes_calls = runs_task();
  finding.runs_sessions = runs_slice();
  return finding;
}

bool VitalSigns::runs_task() const {
  const auto bell = std::make_shared<std::promise<void>>();
  return parts_.pool.try_post([bell] { bell->set_value(); }) && rings(bell);
}

bool VitalSigns::runs_slice() const {
  const auto bell = std::make_shared<std::promise<void>>();
  parts_.scheduler.wake(std::make_shared<Probe>(bell));
  return rings(bell);
}

std::string VitalSigns::Finding::json() const {
  const char* const status = !is_alive()   ? "failing"
                             : is_draining ? "draining"
                             : is_full     ? "full"
                                           : "serving";
  return nlohmann::ordered_json{{"status", status},
                                {"checks",
                                 {{"takes_connections", takes_connections},
                                  {"takes_calls", takes_calls},
                                  {"runs_sessions", runs_sessions}}}}
             .dump() +
         "\n";
}

}  // namespace lpdeform
