#include "client/cpp/client.h"

#include <thread>
#include <utility>

#include "client/cpp/lease.h"
#include "client/cpp/link.h"
#include "client/cpp/names.h"
#include "client/cpp/recovery.h"
#include "client/cpp/rpc.h"
#include "client/cpp/snapshot.h"
#include "client/cpp/upload.h"

namespace lpdeform::client {

Session::Session(std::unique_ptr<Link> link) : link_(std::move(link)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

absl::StatusOr<std::uint64_t> Session::update(Update update) {
  return link_->update(std::move(update));
}

absl::StatusOr<std::uint64_t> Session::set_handle(std::string_view name, Handle handle) {
  Update update;
  update.handles.emplace(name, std::move(handle));
  return link_->update(std::move(update));
}

absl::StatusOr<std::uint64_t> Session::move(std::string_view name, Motion motion) {
  Update update;
  update.handles.emplace(name, std::move(motion));
  return link_->update(std::move(update));
}

absl::StatusOr<std::uint64_t> Session::remove(std::string_view name) {
  Update update;
  update.handles.emplace(name, Update::Removal{});
  return link_->update(std::move(update));
}

absl::StatusOr<std::uint64_t> Session::set(Settings settings) {
  Update update;
  update.settings = std::move(settings);
  return link_->update(std::move(update));
}

absl::StatusOr<Frame> Session::next_frame(std::chrono::milliseconds timeout) {
  return link_->next_frame(std::chrono::steady_clock::now() + timeout);
}

absl::StatusOr<std::optional<Frame>> Session::poll() {
  return link_->poll();
}

bool Session::wait(std::chrono::milliseconds timeout) {
  return link_->wait(std::chrono::steady_clock::now() + timeout);
}

absl::StatusOr<Frame> Session::settle(std::chrono::milliseconds timeout) {
  return link_->settle(std::chrono::steady_clock::now() + timeout);
}

absl::StatusOr<std::uint64_t> Session::undo() {
  return link_->undo(false);
}

absl::StatusOr<std::uint64_t> Session::redo() {
  return link_->undo(true);
}

absl::StatusOr<BetterShape> Session::take_better_shape() {
  return link_->take_better_shape();
}

absl::StatusOr<std::string> Session::snapshot() {
  return link_->snapshot();
}

absl::StatusOr<SolveResult> Session::solve(const SolveOptions& options) {
  return link_->solve(options);
}

absl::Status Session::take_over() {
  return link_->take_over();
}

bool Session::is_result(const Frame& frame) const {
  return link_->is_result(frame);
}

std::string Session::name() const {
  return link_->name();
}

void Session::start() {
  link_->start();
}

absl::Status Session::ended() const {
  return link_->ended();
}

absl::Status Session::last_problem() const {
  return link_->last_problem();
}

std::optional<Notice> Session::notice() const {
  return link_->notice();
}

MeshReport Session::mesh_report() const {
  return link_->mesh_report();
}

Connection Session::connection() const {
  return link_->connection();
}

absl::Status Session::close() {
  return link_->close();
}

namespace {

constexpr int kMostWays = 5;

/// Makes `call` with the route of `rpc`. If the answer names another route (SESSION_ELSEWHERE), retries with that one,
/// and `rpc` keeps it. While sessions move between servers, the new route may briefly be wrong as well, so this retries
/// a few times, with pauses of at most 0.4 s.
template <typename Call>
auto by_its_way(std::shared_ptr<Rpc>& rpc, const Call& call) {
  Backoff backoff;
  for (int ways = 1;; ++ways) {
    auto result = call(*rpc);
    const std::string route = route_of(result.status());
    if (route.empty() || ways == kMostWays) return result;
    if (route != rpc->route()) {
      rpc = rpc->going_by(route);
    } else {
      std::this_thread::sleep_for(backoff.next());
    }
  }
}

}  // namespace

Client::Client(std::shared_ptr<Rpc> rpc, ClientOptions options)
    : rpc_(std::move(rpc)), options_(std::move(options)) {}

absl::StatusOr<Client> Client::connect(std::string_view address, ClientOptions options,
                                       const std::stop_token& stop) {
  auto rpc = Rpc::connect(std::string(address), options, stop);
  if (!rpc.ok()) return rpc.status();
  return Client(*std::move(rpc), std::move(options));
}

absl::StatusOr<Session> Client::open(Mesh mesh, OpenOptions options, const std::stop_token& stop) {
  auto lease = create_session(*rpc_, mesh, options, new_request_id(), stop);
  if (!lease.ok()) return lease.status();
  Copy copy = copy_of(std::move(mesh), options);
  return Session(
      std::make_unique<Link>(rpc_, options_, std::move(options), std::move(copy), *std::move(lease)));
}

absl::StatusOr<Session> Client::open_snapshot(std::string file, OpenOptions options,
                                              const std::stop_token& stop) {
  auto lease = restore_session(*rpc_, file, new_request_id(), stop);
  if (!lease.ok()) return lease.status();
  Copy copy = copy_of(std::move(file), lease->mesh.vertices);
  return Session(
      std::make_unique<Link>(rpc_, options_, std::move(options), std::move(copy), *std::move(lease)));
}

absl::StatusOr<Session> Client::join(std::string_view session, Role role, OpenOptions options,
                                     const std::stop_token& stop) {
  const absl::Status checked = check_name("session", session);
  if (!checked.ok()) return checked;
  std::shared_ptr<Rpc> rpc = rpc_;
  auto lease = by_its_way(rpc, [&](Rpc& way) { return join_session(way, std::string(session), role, stop); });
  if (lease.ok() && !lease->route.empty() && lease->route != rpc->route())
    rpc = rpc->going_by(lease->route);  // use the same route as the session's other clients
  if (!lease.ok()) return lease.status();
  return Session(
      std::make_unique<Link>(std::move(rpc), options_, std::move(options), Copy(), *std::move(lease)));
}

absl::StatusOr<std::string> Client::snapshot(std::string_view session) {
  std::shared_ptr<Rpc> rpc = rpc_;
  return by_its_way(rpc, [&](Rpc& way) { return take_snapshot(way, std::string(session), {}); });
}

absl::StatusOr<std::string> Client::restore(std::string_view snapshot) {
  const auto lease = restore_session(*rpc_, snapshot, new_request_id(), {});
  if (!lease.ok()) return lease.status();
  return lease->session;
}

absl::Status Client::remove(std::string_view session) {
  v1::DeleteSessionRequest request;
  request.set_session(std::string(session));
  std::shared_ptr<Rpc> rpc = rpc_;
  return by_its_way(rpc, [&](Rpc& way) { return way.call(request, {}); }).status();
}

}  // namespace lpdeform::client
