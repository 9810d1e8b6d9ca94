// The functions of the C interface. Each checks its arguments, makes the call, and reports the result. No exception
// leaves it.

#include "client/c/lpdeform.h"

#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "client/c/changes.h"
#include "client/c/error.h"
#include "client/c/live_session.h"
#include "client/c/options.h"
#include "client/c/server.h"
#include "client/c/structs.h"
#include "client/c/vertex_source.h"
#include "client/cpp/client.h"
#include "client/cpp/guarded.h"
#include "client/cpp/names.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace engine = lpdeform::engine;
namespace client = lpdeform::client;
using lpdeform::make_fault;
using lpdeform::Reason;
using lpdeform::engine::argument_missing;
using lpdeform::engine::check_enum;

struct lpdeform_client {
  std::shared_ptr<engine::Server> server;
};

struct lpdeform_session {
  std::shared_ptr<engine::LiveSession> live;
};

struct lpdeform_snapshot {
  std::string file;
};

namespace {

/// Calls `work`, which returns a Status, and reports the result.
template <typename Work>
lpdeform_code guarded(lpdeform_error* error, Work work) {
  const absl::Status done = client::guarded(work);
  try {
    return engine::tell(done, error);
  } catch (...) {  // out of memory for the error text
    return static_cast<lpdeform_code>(done.code());
  }
}

absl::StatusOr<std::shared_ptr<engine::LiveSession>> open(engine::Server& server, const lpdeform_mesh* mesh,
                                                          const lpdeform_options* options) {
  auto read = engine::read_options(options);
  if (!read.ok()) return read.status();
  const auto given = engine::read_struct(mesh, "mesh");
  if (!given.ok()) return given.status();
  auto copy = engine::read_mesh(*given, read->facts.space);
  if (!copy.ok()) return copy.status();
  read->open.weld = engine::read_weld(*given);
  read->facts.vertex_count = given->vertex_count;
  return server.start(
      [mesh = *std::move(copy), how = read->open](client::Client& to, const std::stop_token& stop) {
        return to.open(mesh, how, stop);
      },
      read->facts);
}

absl::StatusOr<std::shared_ptr<engine::LiveSession>> join(engine::Server& server, const char* name,
                                                          lpdeform_role role,
                                                          const lpdeform_options* options) {
  if (name == nullptr) return argument_missing("name");
  absl::Status checked = check_enum("role", role, LPDEFORM_WRITER);
  checked.Update(client::check_name("session", name));
  if (!checked.ok()) return checked;
  auto read = engine::read_options(options);
  if (!read.ok()) return read.status();
  read->facts.is_reader = role == LPDEFORM_READER;
  const auto as = role == LPDEFORM_READER ? client::Role::kReader : client::Role::kWriter;
  return server.start(
      [name = std::string(name), as, how = read->open](client::Client& to, const std::stop_token& stop) {
        return to.join(name, as, how, stop);
      },
      read->facts);
}

absl::StatusOr<std::shared_ptr<engine::LiveSession>> restore(engine::Server& server, const void* data,
                                                             std::size_t bytes,
                                                             const lpdeform_options* options) {
  if (data == nullptr) return argument_missing("data");
  auto read = engine::read_options(options);
  if (!read.ok()) return read.status();
  return server.start(
      [file = std::string(static_cast<const char*>(data), bytes), how = read->open](
          client::Client& to, const std::stop_token& stop) { return to.open_snapshot(file, how, stop); },
      read->facts);
}

absl::Status give(absl::StatusOr<std::shared_ptr<engine::LiveSession>> made, lpdeform_session** session) {
  if (!made.ok()) return made.status();
  *session = new lpdeform_session{*std::move(made)};
  return absl::OkStatus();
}

/// Sends the update that `read` makes from the caller's structs.
template <typename Read>
lpdeform_code send(lpdeform_session* session, std::uint64_t* input_seq, lpdeform_error* error, Read read) {
  return guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    absl::StatusOr<client::Update> update = read(session->live->space());
    if (!update.ok()) return update.status();
    const absl::StatusOr<std::uint64_t> seq = session->live->send(*std::move(update));
    if (!seq.ok()) return seq.status();
    if (input_seq != nullptr) *input_seq = *seq;
    return absl::OkStatus();
  });
}

lpdeform_code take_back(lpdeform_session* session, bool redo, std::uint64_t* input_seq,
                        lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    const absl::StatusOr<std::uint64_t> seq = session->live->undo(redo);
    if (!seq.ok()) return seq.status();
    if (input_seq != nullptr) *input_seq = *seq;
    return absl::OkStatus();
  });
}

/// Checks the caller's buffers, calls `frame_of` with them, and returns the description of the frame.
template <typename FrameOf>
lpdeform_code write(lpdeform_session* session, const lpdeform_buffers* buffers, lpdeform_frame* frame,
                    lpdeform_error* error, FrameOf frame_of) {
  bool is_there = false;
  const lpdeform_code code = guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    const auto given = engine::read_struct(buffers, "buffers");
    if (!given.ok()) return given.status();
    const absl::StatusOr<std::optional<lpdeform_frame>> written = frame_of(*session->live, *given);
    if (!written.ok()) return written.status();
    is_there = written->has_value();
    if (is_there) engine::write_struct(**written, frame);
    return absl::OkStatus();
  });
  return code == LPDEFORM_OK && !is_there ? LPDEFORM_NO_FRAME : code;
}

/// A copy of `given`, with room for nothing if it is NULL.
absl::StatusOr<lpdeform_search> read_search(const lpdeform_search* given) {
  if (given == nullptr) return lpdeform_search{};
  const auto search = engine::read_struct(given, "search");
  if (!search.ok()) return search.status();
  if (search->minima == nullptr && search->minima_capacity > 0) return argument_missing("search.minima");
  return *search;
}

lpdeform_notice notice_reason(client::Notice::Reason reason) {
  switch (reason) {
    case client::Notice::Reason::kOverloaded:
      return LPDEFORM_NOTICE_OVERLOADED;
    case client::Notice::Reason::kRecovered:
      return LPDEFORM_NOTICE_RECOVERED;
    case client::Notice::Reason::kBetterShape:
      return LPDEFORM_NOTICE_BETTER_SHAPE;
    default:
      return LPDEFORM_NOTICE_OTHER;
  }
}

}  // namespace

uint32_t lpdeform_abi(void) {
  return LPDEFORM_ABI;
}

const char* lpdeform_version(void) {
  return LPDEFORM_RELEASE;
}

lpdeform_code lpdeform_connect(const lpdeform_connection* connection, lpdeform_client** made,
                               lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (made == nullptr) return argument_missing("client");
    const auto given = engine::read_struct(connection, "connection");
    if (!given.ok()) return given.status();
    auto server = engine::make_server(*given);
    if (!server.ok()) return server.status();
    *made = new lpdeform_client{*std::move(server)};
    return absl::OkStatus();
  });
}

lpdeform_code lpdeform_set_token(lpdeform_client* to, const char* token, lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (to == nullptr) return argument_missing("client");
    return to->server->set_token(token == nullptr ? "" : token);
  });
}

void lpdeform_disconnect(lpdeform_client* from) {
  if (from == nullptr) return;
  guarded(nullptr, [&] {
    from->server->close();
    return absl::OkStatus();
  });
  delete from;
}

lpdeform_code lpdeform_open(lpdeform_client* with, const lpdeform_mesh* mesh, const lpdeform_options* options,
                            lpdeform_session** session, lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (with == nullptr) return argument_missing("client");
    if (session == nullptr) return argument_missing("session");
    return give(open(*with->server, mesh, options), session);
  });
}

lpdeform_code lpdeform_join(lpdeform_client* with, const char* name, lpdeform_role role,
                            const lpdeform_options* options, lpdeform_session** session,
                            lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (with == nullptr) return argument_missing("client");
    if (session == nullptr) return argument_missing("session");
    return give(join(*with->server, name, role, options), session);
  });
}

lpdeform_code lpdeform_restore(lpdeform_client* with, const void* data, size_t bytes,
                               const lpdeform_options* options, lpdeform_session** session,
                               lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (with == nullptr) return argument_missing("client");
    if (session == nullptr) return argument_missing("session");
    return give(restore(*with->server, data, bytes, options), session);
  });
}

lpdeform_code lpdeform_take_snapshot(lpdeform_session* session, lpdeform_snapshot** snapshot,
                                     lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    if (snapshot == nullptr) return argument_missing("snapshot");
    absl::StatusOr<std::string> file = session->live->snapshot();
    if (!file.ok()) return file.status();
    *snapshot = new lpdeform_snapshot{*std::move(file)};
    return absl::OkStatus();
  });
}

const void* lpdeform_snapshot_data(const lpdeform_snapshot* snapshot, size_t* bytes) {
  if (bytes != nullptr) *bytes = snapshot == nullptr ? 0 : snapshot->file.size();
  return snapshot == nullptr ? nullptr : snapshot->file.data();
}

void lpdeform_free_snapshot(lpdeform_snapshot* snapshot) {
  delete snapshot;
}

void lpdeform_close(lpdeform_session* session) {
  if (session == nullptr) return;
  guarded(nullptr, [&] {
    session->live->close();
    return absl::OkStatus();
  });
  delete session;
}

lpdeform_state lpdeform_session_state(const lpdeform_session* session, lpdeform_error* why) {
  lpdeform_state state = LPDEFORM_STATE_REFUSED;
  guarded(why, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    absl::Status said;
    state = session->live->state(said);
    return said;
  });
  return state;
}

lpdeform_notice lpdeform_session_notice(const lpdeform_session* session, char* text, size_t bytes) {
  lpdeform_notice said = LPDEFORM_NOTICE_NONE;
  guarded(nullptr, [&] {
    const std::optional<client::Notice> notice = session == nullptr ? std::nullopt : session->live->notice();
    const std::string of_mesh = session == nullptr || notice ? "" : session->live->mesh_notice();
    if (text != nullptr) engine::copy_text(notice ? notice->text : of_mesh, text, bytes);
    if (!of_mesh.empty()) said = LPDEFORM_NOTICE_MESH;
    if (notice) said = notice_reason(notice->reason);
    return absl::OkStatus();
  });
  return said;
}

lpdeform_code lpdeform_session_better_shape(const lpdeform_session* session, lpdeform_better_shape* better,
                                            lpdeform_error* error) {
  bool is_there = false;
  const lpdeform_code code = guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    const std::optional<lpdeform_better_shape> known = session->live->better_shape();
    is_there = known.has_value();
    if (is_there) engine::write_struct(*known, better);
    return absl::OkStatus();
  });
  return code == LPDEFORM_OK && !is_there ? LPDEFORM_NO_FRAME : code;
}

lpdeform_code lpdeform_session_name(const lpdeform_session* session, char* name, size_t bytes,
                                    lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    if (name == nullptr) return argument_missing("name");
    const absl::StatusOr<std::string> said = session->live->name();
    if (!said.ok()) return said.status();
    if (said->size() >= bytes) {
      return make_fault({Reason::kBufferTooSmall, "name", absl::StrCat("bytes >= ", said->size() + 1)},
                        absl::StrCat("The name needs ", said->size() + 1, " bytes, not ", bytes, "."));
    }
    std::memcpy(name, said->c_str(), said->size() + 1);
    return absl::OkStatus();
  });
}

uint32_t lpdeform_vertex_count(const lpdeform_session* session) {
  std::uint32_t count = 0;
  guarded(nullptr, [&] {
    if (session != nullptr) count = session->live->vertex_count();
    return absl::OkStatus();
  });
  return count;
}

lpdeform_code lpdeform_send(lpdeform_session* session, const lpdeform_update* update, uint64_t* input_seq,
                            lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    const auto given = engine::read_struct(update, "update");
    if (!given.ok()) return given.status();
    return engine::read_update(*given, space);
  });
}

lpdeform_code lpdeform_set_handle(lpdeform_session* session, const lpdeform_handle* handle,
                                  uint64_t* input_seq, lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    if (handle == nullptr) return argument_missing("handle");
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.set_count = 1;
    update.sets = handle;
    return engine::read_update(update, space);
  });
}

lpdeform_code lpdeform_move_handle(lpdeform_session* session, const char* name, const lpdeform_motion* motion,
                                   uint64_t* input_seq, lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    if (motion == nullptr) return argument_missing("motion");
    const lpdeform_move move{name, *motion};
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.moves = &move;
    update.move_count = 1;
    return engine::read_update(update, space);
  });
}

lpdeform_code lpdeform_remove_handle(lpdeform_session* session, const char* name, uint64_t* input_seq,
                                     lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.removals = &name;
    update.removal_count = 1;
    return engine::read_update(update, space);
  });
}

lpdeform_code lpdeform_set(lpdeform_session* session, const lpdeform_settings* settings, uint64_t* input_seq,
                           lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    if (settings == nullptr) return argument_missing("settings");
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.settings = settings;
    return engine::read_update(update, space);
  });
}

lpdeform_code lpdeform_resize(lpdeform_session* session, const lpdeform_resizing* resizing,
                              uint64_t* input_seq, lpdeform_error* error) {
  return send(session, input_seq, error, [&](const engine::Space& space) -> absl::StatusOr<client::Update> {
    const auto given = engine::read_struct(resizing, "resizing");
    if (!given.ok()) return given.status();
    return engine::read_resizing(*given, space);
  });
}

lpdeform_code lpdeform_undo(lpdeform_session* session, uint64_t* input_seq, lpdeform_error* error) {
  return take_back(session, false, input_seq, error);
}

lpdeform_code lpdeform_redo(lpdeform_session* session, uint64_t* input_seq, lpdeform_error* error) {
  return take_back(session, true, input_seq, error);
}

lpdeform_code lpdeform_take_better_shape(lpdeform_session* session, lpdeform_error* error) {
  return guarded(error, [&]() -> absl::Status {
    if (session == nullptr) return argument_missing("session");
    return session->live->take_better_shape();
  });
}

lpdeform_code lpdeform_poll(lpdeform_session* session, const lpdeform_buffers* buffers, lpdeform_frame* frame,
                            lpdeform_error* error) {
  return write(session, buffers, frame, error,
               [](engine::LiveSession& live, const lpdeform_buffers& into) { return live.poll(into); });
}

lpdeform_code lpdeform_repeat(lpdeform_session* session, const lpdeform_buffers* buffers,
                              lpdeform_frame* frame, lpdeform_error* error) {
  return write(session, buffers, frame, error,
               [](engine::LiveSession& live, const lpdeform_buffers& into) { return live.repeat(into); });
}

lpdeform_code lpdeform_settle(lpdeform_session* session, double timeout_seconds,
                              const lpdeform_buffers* buffers, lpdeform_frame* frame, lpdeform_error* error) {
  return write(session, buffers, frame, error,
               [=](engine::LiveSession& live,
                   const lpdeform_buffers& into) -> absl::StatusOr<std::optional<lpdeform_frame>> {
                 const absl::Status checked = engine::check_seconds("timeout_seconds", timeout_seconds);
                 if (!checked.ok()) return checked;
                 return live.settle(timeout_seconds, into);
               });
}

lpdeform_code lpdeform_solve(lpdeform_session* session, const lpdeform_solve_options* options,
                             const lpdeform_buffers* buffers, lpdeform_frame* frame, lpdeform_error* error) {
  return write(session, buffers, frame, error,
               [=](engine::LiveSession& live,
                   const lpdeform_buffers& into) -> absl::StatusOr<std::optional<lpdeform_frame>> {
                 lpdeform_solve_options defaults{};
                 defaults.struct_size = sizeof defaults;
                 const auto given =
                     engine::read_struct(options == nullptr ? &defaults : options, "solve_options");
                 if (!given.ok()) return given.status();
                 absl::Status checked = engine::check_seconds("timeout_seconds", given->timeout_seconds);
                 const absl::StatusOr<lpdeform_search> search = read_search(given->search);
                 checked.Update(search.status());
                 if (!checked.ok()) return checked;
                 lpdeform_search found = *search;
                 const auto frame = live.solve(given->timeout_seconds, given->certify != 0, into, found);
                 if (frame.ok()) engine::write_struct(found, given->search);
                 return frame;
               });
}
