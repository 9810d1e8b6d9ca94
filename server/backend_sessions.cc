// Backend: sessions begin, change and end, and what the store has to do with that.

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "server/backend.h"
#include "server/encode.h"
#include "server/random_name.h"
#include "server/refusals.h"
#include "server/stored_state.h"

namespace lpdeform {
namespace {

/// That a server which shuts down gives its store.
constexpr std::chrono::seconds kFlushPatience{5};

}  // namespace

void Backend::log_session(std::string_view event, const Session& session, const std::string& trace_id) const {
  log().info(event, {{"session", abbreviated(session.name())},
                     {"epoch", session.lease().epoch},
                     {"vertices", std::uint64_t{session.vertex_count()}},
                     {"trace_id", trace_id}});
}

void Backend::create_session(const CallContext& call, const v1::CreateSessionRequest& request,
                             v1::CreateSessionResponse& response, Done done) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return done(caller.status());
  const Registry::OnCreated on_created = [this, &response,
                                          done](const absl::StatusOr<CreatedSession>& created) {
    if (!created.ok()) return done(created.status());
    encode(created->session->info(), registry->idle(), timers->now(), *response.mutable_session());
    response.set_writer_token(created->writer_token);
    done(absl::OkStatus());
  };
  const std::uint64_t fingerprint = fingerprint_of(request);
  const auto make = [this, call, &request, fingerprint, owner = caller->subject, on_created] {
    make_session(call, request, fingerprint, owner, on_created);
  };
  if (keeper_ == nullptr || request.request_id().empty()) return make();
  // A server that was restarted may have made it before.
  keeper_->find_request(caller->subject, request.request_id(),
                        [this, call, make, on_created](absl::StatusOr<std::string> name) {
                          if (!name.ok()) return on_created(name.status());
                          if (name->empty()) return make();
                          when_here(call, *name, [make, on_created](const absl::Status& status) {
                            if (status.ok() || absl::IsNotFound(status)) return make();
                            on_created(status);
                          });
                        });
}

void Backend::make_session(const CallContext& call, const v1::CreateSessionRequest& request,
                           std::uint64_t fingerprint, const std::string& owner,
                           const Registry::OnCreated& on_created) {
  if (!registry->begin_creation(request.request_id(), on_created, fingerprint, owner)) return;
  scheduler.run_once([this, call, owner, &request, fingerprint, on_created] {
    const auto finish = [this, call, owner, request_id = request.request_id(),
                         on_created](absl::StatusOr<std::shared_ptr<Session>> made) {
      if (made.ok()) {
        metrics->add(Count::kSessionsCreated);
        log_session("session_created", **made, call.trace_id);
      }
      registry->finish_creation(request_id, std::move(made), on_created, owner);
    };
    const auto session = factory_.make(owner, request);
    if (!session.ok() || keeper_ == nullptr) return finish(session);
    keep_new(*session, request, fingerprint, [finish, session = *session](const absl::Status& status) {
      finish(status.ok() ? absl::StatusOr<std::shared_ptr<Session>>(session) : status);
    });
  });
}

void Backend::keep_new(std::shared_ptr<Session> session, const v1::CreateSessionRequest& request,
                       std::uint64_t fingerprint, Done done) {
  Decoder decoder = factory_.decoder(request, session->owner());
  auto head = encode_head(request, decoder, fingerprint, session->created_unix_ms());
  if (!head.ok()) return done(head.status());
  keeper_->add(std::move(session), *std::move(head), request.request_id(), std::move(done));
}

void Backend::delete_session(const CallContext& call, const v1::DeleteSessionRequest& request,
                             v1::DeleteSessionResponse&, Done done) {
  const auto session = find(call, Access::kChange, request.session());
  if (absl::IsNotFound(session.status())) {
    const bool is_on_its_way = keeper_ != nullptr && keeper_->is_being_removed(request.session());
    return is_on_its_way ? keeper_->remove(request.session(), std::move(done)) : done(absl::OkStatus());
  }
  if (!session.ok()) return done(session.status());
  if (registry->remove(request.session(), EndReason::kSessionDeleted, "The session was deleted.")) {
    log().info("session_deleted", {{"session", abbreviated(request.session())}, {"trace_id", call.trace_id}});
  }
  if (keeper_ == nullptr) return done(absl::OkStatus());
  keeper_->remove(request.session(), std::move(done));
}

void Backend::acquire_writer(const CallContext& call, const v1::AcquireWriterRequest& request,
                             v1::AcquireWriterResponse& response, Done done) {
  const auto session = find(call, Access::kChange, request.session());
  if (!session.ok()) return done(session.status());
  const WriterLease lease = (*session)->acquire_writer();
  response.set_writer_token(lease.token);
  response.set_epoch(lease.epoch);
  response.set_input_seq(lease.input_seq);
  log().info("writer_replaced", {{"session", abbreviated(request.session())},
                                 {"epoch", lease.epoch},
                                 {"input_seq", lease.input_seq},
                                 {"trace_id", call.trace_id}});
  if (keeper_ == nullptr) return done(absl::OkStatus());
  keeper_->changed(**session, 0, lease.epoch, [done = std::move(done)](bool is_kept) {
    done(is_kept ? absl::OkStatus() : store_failing("the new writer could not be kept; take over again"));
  });
}

void Backend::update_handles(const CallContext& call, const v1::UpdateHandlesRequest& request,
                             v1::UpdateHandlesResponse& response, Done done) {
  const auto session = find(call, Access::kChange, request.session());
  if (!session.ok()) return done(session.status());
  update(call, **session, request.writer_token(), request.update(),
         [&response, done = std::move(done)](const absl::StatusOr<UpdateResult>& result) {
           if (result.ok()) encode(*result, *response.mutable_result());
           done(result.status());
         });
}

void Backend::update(const CallContext& call, Session& session, const std::string& token,
                     const v1::Update& update, const OnUpdated& answered) {
  const auto result = take_update(call, session, token, update);
  if (!result.ok()) return answered(result);
  when_kept(session, result->revision, [result = *result, answered](bool is_kept) mutable {
    result.is_kept = is_kept;
    answered(result);
  });
}

absl::StatusOr<UpdateResult> Backend::take_update(const CallContext& call, Session& session,
                                                  const std::string& token, const v1::Update& update) {
  if (absl::Status status = session.check_writer(token); !status.ok()) return status;
  const auto decoded = Decoder(*uploads_, session.vertex_count(), &session.features(),
                               session.mesh().weld().get(), session.owner())
                           .update(update);
  if (!decoded.ok()) return decoded.status();
  const auto result = session.update(token, *decoded);
  if (result.ok()) {
    log().debug("update", {{"session", abbreviated(session.name())},
                           {"epoch", session.lease().epoch},
                           {"input_seq", result->input_seq},
                           {"stale_parts", std::uint64_t{result->stale_parts}},
                           {"trace_id", call.trace_id}});
  }
  return result;
}

void Backend::when_kept(const Session& session, std::uint64_t revision, Keeper::OnKept on_kept) {
  if (keeper_ == nullptr) return on_kept(false);
  keeper_->changed(session, revision, 0, std::move(on_kept));
}

void Backend::when_here(const CallContext& call, const std::string& name, Done then) {
  const auto caller = identify(call, Access::kRead);
  // What is wrong with the caller, find() says.
  if (keeper_ == nullptr || !caller.ok() || !is_session_name(name) || registry->has(name)) {
    return then(absl::OkStatus());
  }
  const Done in_pool = [this, then = std::move(then)](const absl::Status& status) {
    if (!pool.try_post([then, status] { then(status); })) then(server_busy(pool.expected_wait()));
  };
  {
    const std::scoped_lock lock(restoring_mutex_);
    if (registry->has(name)) return in_pool(absl::OkStatus());  // since a moment ago
    const auto [restoring, is_new] = restoring_.try_emplace(name, Restoring{caller->subject, {}});
    if (!is_new && restoring->second.owner != caller->subject) return in_pool(absl::OkStatus());
    restoring->second.waiting.push_back(in_pool);
    if (!is_new) return;
  }
  keeper_->take_over(name, caller->subject, [this, name](absl::StatusOr<Keeper::Found> found) {
    if (!found.ok()) return end_restoring(name, found.status());
    scheduler.run_once([this, name, found = std::move(found)] { make_again(name, found); });
  });
}

/// On a thread of the scheduler.
void Backend::make_again(const std::string& name, absl::StatusOr<Keeper::Found> found) {
  const auto head = decode_head(found->session.parts);
  if (!head.ok()) return end_restoring(name, head.status());
  const std::string& owner = found->session.owner;
  if (absl::Status status = registry->begin_restoring(owner); !status.ok())
    return end_restoring(name, status);
  const auto session = factory_.make_again(name, found->session, *head, found->blobs);
  if (session.ok()) {
    keeper_->adopt(*session, found->session);
    metrics->add(Count::kSessionsRestored);
    log_session("session_restored", **session, "");
  }
  registry->finish_restoring(owner, session, head->request.request_id(), head->fingerprint);
  end_restoring(name, session.status());
}

void Backend::end_restoring(const std::string& name, const absl::Status& status) {
  std::vector<Done> waiting;
  {
    const std::scoped_lock lock(restoring_mutex_);
    waiting.swap(restoring_.at(name).waiting);
    restoring_.erase(name);
  }
  // What there is not, find() does not find either.
  const bool is_unknown = fault_of(status).reason == "SESSION_UNKNOWN";
  for (const Done& then : waiting) then(is_unknown ? absl::OkStatus() : status);
}

void Backend::release_sessions(const std::string& text) {
  registry->clear(EndReason::kDraining, text);
  if (keeper_) keeper_->flush(std::chrono::steady_clock::now() + kFlushPatience);
}

}  // namespace lpdeform
