// Backend: sessions begin, change and end, and what that means for the store.

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/calls/backend.h"
#include "server/keeping/encode_stored.h"
#include "server/keeping/snapshot.h"
#include "server/keeping/stored_state.h"
#include "server/runtime/random_name.h"
#include "server/runtime/refusals.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

constexpr std::uint32_t kDefaultPage = 100, kLargestPage = 1000;
/// The prefix of page tokens that continue with sessions that only the store has.
constexpr std::string_view kKeptOnly = "kept:";

}  // namespace

void Backend::log_session(std::string_view event, const Session& session, const std::string& trace_id) const {
  log().info(event, {{"session", abbreviated(session.name())},
                     {"epoch", session.lease().epoch},
                     {"vertices", std::uint64_t{session.vertex_count()}},
                     {"trace_id", trace_id}});
}

template <typename Response>
Registry::OnCreated Backend::answering(Response& response, Done done) const {
  return [this, &response, done = std::move(done)](const absl::StatusOr<CreatedSession>& created) {
    if (!created.ok()) return done(created.status());
    encode(created->session->info(), registry->idle(), timers->now(), *response.mutable_session());
    response.set_writer_token(created->writer_token);
    done(absl::OkStatus());
  };
}

void Backend::create_session(const CallContext& call, const v1::CreateSessionRequest& request,
                             v1::CreateSessionResponse& response, Done done) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return done(caller.status());
  const std::uint64_t fingerprint = fingerprint_of(request);
  const auto make = [this, call, &request, owner = caller->subject, fingerprint] {
    return make_new({owner, call.route}, request, fingerprint);
  };
  create_once({call, request.request_id(), caller->subject, fingerprint, "session_created", make,
               answering(response, std::move(done))});
}

void Backend::restore_session(const CallContext& call, const v1::RestoreSessionRequest& request,
                              v1::RestoreSessionResponse& response, Done done) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return done(caller.status());
  const std::uint64_t fingerprint = fingerprint_of(request);
  const auto make = [this, call, &request, owner = caller->subject, fingerprint] {
    return make_restored({owner, call.route}, request, fingerprint);
  };
  create_once({call, request.request_id(), caller->subject, fingerprint, "session_from_snapshot", make,
               answering(response, std::move(done))});
}

void Backend::create_once(const Creation& creation) {
  if (keeper_ == nullptr || creation.request_id.empty()) return make_session(creation);
  // The server may have created the session before a restart.
  keeper_->find_request(
      creation.owner, creation.request_id, [this, creation](const absl::StatusOr<std::string>& name) {
        if (!name.ok()) return creation.on_created(name.status());
        if (name->empty()) return make_session(creation);
        with_session(creation.call, Access::kChange, *name, [this, creation](const auto& found) {
          if (found.ok() || absl::IsNotFound(found.status())) return make_session(creation);
          creation.on_created(found.status());
        });
      });
}

void Backend::make_session(const Creation& creation) {
  if (!registry->begin_creation(creation.request_id, creation.on_created, creation.fingerprint,
                                creation.owner))
    return;
  scheduler_.run_once([this, creation] {
    const auto finish = [this, creation](absl::StatusOr<std::shared_ptr<Session>> made) {
      if (made.ok()) {
        metrics->add(Count::kSessionsCreated);
        log_session(creation.event, **made, creation.call.trace_id);
      }
      registry->finish_creation(creation.request_id, std::move(made), creation.on_created, creation.owner);
    };
    auto made = creation.make();
    if (!made.ok()) return finish(made.status());
    if (keeper_ == nullptr) return finish(made->session);
    const std::shared_ptr<Session> session = made->session;
    keeper_->add(session, std::move(made->head), creation.request_id,
                 [finish, session](const absl::Status& status) {
                   finish(status.ok() ? absl::StatusOr<std::shared_ptr<Session>>(session) : status);
                 });
  });
}

absl::StatusOr<NewSession> Backend::make_new(const SessionMaker& maker,
                                             const v1::CreateSessionRequest& request,
                                             std::uint64_t fingerprint) const {
  auto session = factory_.make(maker, request);
  if (!session.ok()) return session.status();
  NewSession made{*std::move(session), {}};
  if (keeper_ == nullptr) return made;
  Decoder decoder = factory_.decoder(request, maker.owner);
  auto head = encode_head(request, decoder, fingerprint, made.session->created_unix_ms());
  if (!head.ok()) return head.status();
  made.head = *std::move(head);
  return made;
}

absl::StatusOr<NewSession> Backend::make_restored(const SessionMaker& maker,
                                                  const v1::RestoreSessionRequest& request,
                                                  std::uint64_t fingerprint) const {
  const auto file =
      Decoder(*uploads_, 0, nullptr, nullptr, maker.owner).bytes(request.snapshot(), "snapshot");
  if (!file.ok()) return file.status();
  const auto snapshot = decode_snapshot(file->view, *budget_, maker.owner);
  if (!snapshot.ok()) return snapshot.status();
  auto session = factory_.make_from(maker, *snapshot);
  if (!session.ok()) return session.status();
  NewSession made{*std::move(session), {}};
  if (keeper_ == nullptr) return made;
  static const StoredBlobs no_blobs;
  Decoder decoder = factory_.decoder(snapshot->request, maker.owner).reading_stored(no_blobs);
  // A snapshot does not name the request that restores it. The store must know it, for a server that was
  // restarted.
  v1::CreateSessionRequest kept = snapshot->request;
  kept.set_request_id(request.request_id());
  auto head = encode_head(kept, decoder, fingerprint, made.session->created_unix_ms());
  if (!head.ok()) return head.status();
  made.head = *std::move(head);
  return made;
}

absl::StatusOr<Backend::SnapshotFile> Backend::snapshot(const CallContext& call,
                                                        const Session& session) const {
  auto memory = budget_->reserve(snapshot_bytes(session), session.owner());
  if (!memory.ok()) return memory.status();
  auto bytes = encode_snapshot(session);
  if (!bytes.ok()) return bytes.status();
  SnapshotFile file{*std::move(bytes), *std::move(memory)};
  file.memory.resize(file.bytes.size());
  log_session("snapshot_made", session, call.trace_id);
  return file;
}

void Backend::list_sessions(const CallContext& call, const v1::ListSessionsRequest& request,
                            v1::ListSessionsResponse& response, Done done) {
  if (request.page_size() > kLargestPage) {
    return done(
        make_fault({Reason::kPageSize, "page_size", absl::StrCat("page_size <= ", kLargestPage)},
                   absl::StrCat("A page of ", request.page_size(), " sessions is over ", kLargestPage, ".")));
  }
  const auto caller = identify(call, Access::kRead);
  if (!caller.ok()) return done(caller.status());
  const std::size_t most = request.page_size() == 0 ? kDefaultPage : request.page_size();
  const std::string& token = request.page_token();
  if (keeper_ && token.starts_with(kKeptOnly))
    return list_kept(caller->subject, token.substr(kKeptOnly.size()), most, response, std::move(done));
  const auto page = registry->list(most, token, caller->subject);
  if (!page.ok()) return done(page.status());
  for (const auto& session : page->sessions) {
    v1::Session& listed = *response.add_sessions();
    encode(session->info(), registry->idle(), timers->now(), listed);
    listed.clear_handles();
    listed.mutable_mesh()->clear_defects();
  }
  response.set_next_page_token(page->next_page_token);
  if (keeper_ == nullptr || !page->next_page_token.empty()) return done(absl::OkStatus());
  list_kept(caller->subject, "", most - page->sessions.size(), response, std::move(done));
}

/// Adds the sessions that only the store has. If the page has no room for any, its token says that there may
/// be some.
void Backend::list_kept(const std::string& owner, const std::string& after, std::size_t most,
                        v1::ListSessionsResponse& response, Done done) {
  const auto is_elsewhere = [this](const std::string& name) { return !registry->has(name); };
  keeper_->list(owner, after, most + 1, is_elsewhere,
                [after, most, &response, done](const absl::StatusOr<std::vector<std::string>>& names) {
                  if (!names.ok()) return done(names.status());
                  for (std::size_t k = 0; k < std::min(most, names->size()); ++k) {
                    v1::Session& listed = *response.add_sessions();
                    listed.set_name(names->at(k));
                    listed.set_is_kept_only(true);
                  }
                  if (names->size() > most)
                    response.set_next_page_token(
                        absl::StrCat(std::string(kKeptOnly), most == 0 ? after : names->at(most - 1)));
                  done(absl::OkStatus());
                });
}

void Backend::delete_session(const CallContext& call, const v1::DeleteSessionRequest& request,
                             v1::DeleteSessionResponse&, Done done) {
  with_session(
      call, Access::kChange, request.session(),
      [this, call, name = request.session(), done = std::move(done)](const auto& session) mutable {
        if (absl::IsNotFound(session.status())) {
          const bool is_on_its_way = keeper_ != nullptr && keeper_->is_being_removed(name);
          return is_on_its_way ? keeper_->remove(name, std::move(done)) : done(absl::OkStatus());
        }
        if (!session.ok()) return done(session.status());
        if (registry->remove(name, EndReason::kSessionDeleted, "The session was deleted."))
          log().info("session_deleted", {{"session", abbreviated(name)}, {"trace_id", call.trace_id}});
        if (keeper_ == nullptr) return done(absl::OkStatus());
        keeper_->remove(name, std::move(done));
      });
}

void Backend::acquire_writer(const CallContext& call, const v1::AcquireWriterRequest& request,
                             v1::AcquireWriterResponse& response, Done done) {
  with_session(call, Access::kChange, request.session(),
               [this, call, &response, done = std::move(done)](const auto& session) {
                 if (!session.ok()) return done(session.status());
                 replace_writer(call, *session, response, done);
               });
}

void Backend::replace_writer(const CallContext& call, const std::shared_ptr<Session>& session,
                             v1::AcquireWriterResponse& response, const Done& done) {
  if (absl::Status status = keeper_ ? keeper_->may_keep(*session) : absl::OkStatus(); !status.ok())
    return done(status);
  const WriterLease lease = session->acquire_writer();
  response.set_writer_token(lease.token);
  response.set_epoch(lease.epoch);
  response.set_input_seq(lease.input_seq);
  log().info("writer_replaced", {{"session", abbreviated(session->name())},
                                 {"epoch", lease.epoch},
                                 {"input_seq", lease.input_seq},
                                 {"trace_id", call.trace_id}});
  if (keeper_ == nullptr) return done(absl::OkStatus());
  keeper_->changed(*session, 0, lease.epoch, [this, session, done](bool is_kept) {
    if (is_kept) return done(absl::OkStatus());
    const absl::Status why = keeper_->may_keep(*session);
    done(is_full(why) ? why : store_failing("the new writer could not be kept; take over again"));
  });
}

void Backend::update_handles(const CallContext& call, const v1::UpdateHandlesRequest& request,
                             v1::UpdateHandlesResponse& response, Done done) {
  const auto answered = [&response, done](const absl::StatusOr<UpdateResult>& result) {
    if (result.ok()) encode(*result, *response.mutable_result());
    done(result.status());
  };
  with_session(
      call, Access::kChange, request.session(), [this, &call, &request, answered](const auto& session) {
        if (!session.ok()) return answered(session.status());
        const Change change{*session, (*session)->writer(request.writer_token())};
        when_decodable(change, request.update(),
                       [this, &call, &request, change, answered](const absl::Status& status) {
                         status.ok() ? update(call, change, request.update(), answered) : answered(status);
                       });
      });
}

void Backend::take_better_shape(const CallContext& call, const v1::TakeBetterShapeRequest& request,
                                v1::TakeBetterShapeResponse& response, Done done) {
  with_session(call, Access::kChange, request.session(),
               [&request, &response, done = std::move(done)](const auto& session) {
                 if (!session.ok()) return done(session.status());
                 const auto better = (*session)->take_better((*session)->writer(request.writer_token()));
                 if (!better.ok()) return done(better.status());
                 response.set_input_seq(better->input_seq);
                 response.set_energy(better->energy);
                 done(absl::OkStatus());
               });
}

void Backend::undo_update(const CallContext& call, const v1::UndoUpdateRequest& request,
                          v1::UndoUpdateResponse& response, Done done) {
  with_session(call, Access::kChange, request.session(),
               [this, &request, &response, done = std::move(done)](const auto& session) {
                 if (!session.ok()) return done(session.status());
                 undo(**session, request, response, done);
               });
}

void Backend::undo(Session& session, const v1::UndoUpdateRequest& request, v1::UndoUpdateResponse& response,
                   const Done& done) {
  const auto result =
      session.undo(session.writer(request.writer_token()), request.input_seq(), request.redo());
  if (!result.ok()) return done(result.status());
  encode(result->update, *response.mutable_result());
  for (const HandleChange& change : result->changes) encode_change(change, *response.add_changes());
  response.set_undo_steps(static_cast<std::uint32_t>(result->undo_steps));
  response.set_redo_steps(static_cast<std::uint32_t>(result->redo_steps));
  when_kept(session, result->update.revision, [&response, done](bool is_kept) {
    response.mutable_result()->set_kept(is_kept);
    done(absl::OkStatus());
  });
}

void Backend::update(const CallContext& call, const Change& change, const v1::Update& update,
                     const OnUpdated& answered) {
  const auto result = take_update(call, change, update);
  if (!result.ok()) return answered(result);
  when_kept(*change.session, result->revision, [result = *result, answered](bool is_kept) mutable {
    result.is_kept = is_kept;
    answered(result);
  });
}

absl::StatusOr<UpdateResult> Backend::take_update(const CallContext& call, const Change& change,
                                                  const v1::Update& update) {
  Session& session = *change.session;
  const auto decoded = Decoder(*uploads_, session.vertex_count(), &session.features(),
                               session.mesh().weld().get(), session.owner())
                           .update(update);
  if (!decoded.ok()) return decoded.status();
  const auto result = session.update(change.writer, *decoded);
  if (result.ok()) {
    log().debug("update", {{"session", abbreviated(session.name())},
                           {"epoch", change.writer->epoch},
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

void Backend::with_session(const CallContext& call, Access access, const std::string& name, OnSession then) {
  const auto caller = identify(call, access);
  if (!caller.ok()) return then(caller.status());
  auto here = registry->find(name, caller->subject);
  if (here.ok() || keeper_ == nullptr || !is_session_name(name) || registry->has(name)) return then(here);
  fetch(call, name, caller->subject, std::move(then));
}

/// Restores a session from the store if it is not here.
void Backend::fetch(const CallContext& call, const std::string& name, const std::string& owner,
                    OnSession then) {
  const Done in_pool = [this, name, owner, then = std::move(then)](const absl::Status& status) {
    const auto tell = [this, name, owner, then, status] {
      status.ok() ? then(registry->find(name, owner)) : then(status);
    };
    if (!pool_.try_post(tell)) then(server_busy(pool_.expected_wait()));
  };
  {
    const std::scoped_lock lock(restoring_mutex_);
    if (registry->has(name)) return in_pool(absl::OkStatus());  // it has just been restored
    const auto [restoring, is_new] = restoring_.try_emplace(name, Restoring{owner, {}});
    if (!is_new && restoring->second.owner != owner) return in_pool(absl::OkStatus());
    restoring->second.waiting.push_back(in_pool);
    if (!is_new) return;
  }
  keeper_->take_over(name, {owner, call.route}, [this, name](absl::StatusOr<Keeper::Found> found) {
    if (!found.ok()) return end_restoring(name, found.status());
    scheduler_.run_once([this, name, found = std::move(found)] { make_again(name, found); });
  });
}

void Backend::when_decodable(const Change& change, const v1::Update& update, Done then) {
  if (!change.writer.ok()) return then(change.writer.status());
  geometry_.when_found(change.session, update, std::move(then));
}

/// Called on a thread of the scheduler.
void Backend::make_again(const std::string& name, absl::StatusOr<Keeper::Found> found) {
  const auto give_up = [&](const absl::Status& status) {
    keeper_->give_up(name);
    end_restoring(name, status);
  };
  const auto head = decode_head(found->session.parts);
  if (!head.ok()) return give_up(head.status());
  const std::string& owner = found->session.owner;
  if (absl::Status status = registry->begin_restoring(owner); !status.ok()) return give_up(status);
  const auto session = factory_.make_again(name, found->session, *head, found->blobs);
  if (session.ok()) {
    keeper_->adopt(*session, found->session);
    metrics->add(Count::kSessionsRestored);
    log_session("session_restored", **session, "");
  }
  registry->finish_restoring(owner, session, head->request.request_id(), head->fingerprint);
  if (!session.ok()) return give_up(session.status());
  end_restoring(name, absl::OkStatus());
}

void Backend::end_restoring(const std::string& name, const absl::Status& status) {
  std::vector<Done> waiting;
  {
    const std::scoped_lock lock(restoring_mutex_);
    waiting.swap(restoring_.at(name).waiting);
    restoring_.erase(name);
  }
  if (const std::string damage = damage_of(status); !damage.empty()) {
    metrics->add(Count::kSessionsDamaged);
    log().error("session_damaged", {{"session", abbreviated(name)}, {"text", damage}});
  }
  // find() will answer for a session that does not exist.
  const bool is_unknown = fault_of(status).reason == Reason::kSessionUnknown;
  if (is_unknown) registry->forget_left(name);
  for (const Done& then : waiting) then(is_unknown ? absl::OkStatus() : status);
}

bool Backend::release_sessions(const std::string& text) {
  registry->clear(EndReason::kDraining, text);
  return !keeper_ || keeper_->flush(std::chrono::steady_clock::now() + kFlushPatience).empty();
}

}  // namespace lpdeform
