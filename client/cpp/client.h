#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/types.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

/// The C++ client of an lpdeform server.
///
///   auto client = Client::connect("localhost:7070");
///   auto session = client->open(mesh);
///   session->set_handle("base", {.vertices = base}).value();
///   session->set_handle("tip", {.vertices = tip, .motion = RigidMotion{.translation = {0, 0, 1}}}).value();
///   auto frame = session->settle(std::chrono::seconds(10));
///
/// Errors are absl::Status. What the server says about one is kept: fault_of(status) gives the stable reason, to
/// be compared with Reason::kSessionUnknown and the like, the element and the limit. UNAVAILABLE: no server, or it
/// went away. Nothing throws.
namespace lpdeform::client {

class Rpc;
class Link;

/// The time after which the server asks to retry a call that failed with this status; 0 if a retry does not help.
std::chrono::milliseconds retry_after(const absl::Status& status);

/// Settings of a TLS connection. All texts are PEM.
struct Tls {
  std::string root_certificates = {};  // trusted roots; empty: those that the system trusts
  std::string certificate_chain = {};  // of this client, if the server requires one (mutual TLS)
  std::string private_key = {};
};

struct ClientOptions {
  /// Deadline of connect(), which fails sooner if the address refuses the connection.
  std::chrono::milliseconds connect_timeout = std::chrono::seconds(10);
  /// Deadline of every other call, except Session::solve, which has its own.
  std::chrono::milliseconds call_timeout = std::chrono::seconds(30);
  /// How long a live session retries while its server is unreachable. After that it ends, and next_frame returns
  /// UNAVAILABLE on every call. A running solve also returns UNAVAILABLE, and may be started again.
  std::chrono::milliseconds reconnect_for = std::chrono::minutes(2);
  std::optional<Tls> tls = {};  // empty: plain text
  /// Called at the beginning of each call, on any thread; returns its bearer token, so that tokens can be renewed. No
  /// function or an empty text: no token. A text with anything but printable ASCII counts as no token.
  std::function<std::string()> token = {};
};

struct OpenOptions {
  WeightKind weights = WeightKind::kCotangent;
  FreeComponents free_components = FreeComponents::kError;
  Weld weld = {};
  Settings settings = {};
  /// Credit: how many frames may be under way and not yet taken, 1 to 8; 0 means the server's default, 2.
  std::uint32_t credit = 0;
  bool double_precision = false;  // positions in raw frames are sent as float64
  Encoding encoding = Encoding::kRaw;
  /// The least precise encoding that the server may switch to because of its limit of bytes per second. It lowers the
  /// frame rate first.
  Encoding lowest_encoding = Encoding::kRaw;
  bool without_distortion = false;
  bool with_normals = false;  // fills Frame::normals
  /// Each result is sent a second time with its Frame::optimality_gap, unless a new update arrives first. The server
  /// computes the gap when there was no update for a tenth of a second.
  bool certify = false;
  double max_frames_per_second = 0;  // 0: no limit; the last frame of an update is always sent
};

enum class Role { kReader, kWriter };

enum class Connection { kIdle, kConnected, kReconnecting, kClosed };

/// A mesh being deformed on a server. Every function may be called from any thread at any time, except that the
/// destructor and moving a Session must not overlap another call. The comment of a function says if it waits for the
/// server. All other functions take no longer than copying their arguments.
///
/// Frames are received on one stream, which opens with the first call of next_frame, poll or settle. A broken stream is
/// reopened with exponential backoff: to the same session if the server still has it, otherwise to a new session that
/// is created from the client's copy of mesh, handles and settings. Frames of an older epoch, or for an older update
/// than a frame before, are dropped.
class Session {
 public:
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  /// Calls close().
  ~Session();

  /// Sends a change and returns its number. Frames with at least this input_seq include the change. Does not wait.
  /// Changes that are made faster than the connection can send them are merged: the newest value of each handle and
  /// each setting wins. If the server refuses a change, next_frame returns the error once; the session continues
  /// without this change and without changes merged into it. Errors: FAILED_PRECONDITION once closed (SESSION_CLOSED)
  /// or for a reader (NOT_THE_WRITER); INVALID_ARGUMENT NAME_ENCODING if the name of a handle is not UTF-8.
  absl::StatusOr<std::uint64_t> update(Update update);

  /// Adds the handle or replaces the one of that name. As update().
  absl::StatusOr<std::uint64_t> set_handle(std::string_view name, Handle handle);
  /// Moves a handle. As update().
  absl::StatusOr<std::uint64_t> move(std::string_view name, Motion motion);
  /// Removes a handle. As update().
  absl::StatusOr<std::uint64_t> remove(std::string_view name);
  /// Changes p, stiffness, method and so on. As update().
  absl::StatusOr<std::uint64_t> set(Settings settings);

  /// Waits for the newest frame that was not taken yet, and takes it. Taking a frame gives credit back to the server,
  /// so a caller that stops taking frames holds up only a bounded number of them (backpressure). Errors:
  /// DEADLINE_EXCEEDED; the server's error about an update (the session continues); when the session has ended, the
  /// reason for it (NOT_FOUND SESSION_DELETED, ABORTED WRITER_REPLACED, UNAVAILABLE, FAILED_PRECONDITION
  /// SESSION_CLOSED), on every call.
  absl::StatusOr<Frame> next_frame(std::chrono::milliseconds timeout);

  /// The same without waiting; empty if there is no new frame.
  absl::StatusOr<std::optional<Frame>> poll();

  /// Waits until next_frame has a frame or an error to return, without taking it. False on timeout.
  bool wait(std::chrono::milliseconds timeout);

  /// Waits for the final result of the newest update, taking frames until it arrives. Returns at once, even with a
  /// timeout of 0 or while the connection is down, if the frame taken last (here, by next_frame or by poll) is that
  /// result. Does not wait for the optimality_gap, which a later frame has. Errors as next_frame.
  absl::StatusOr<Frame> settle(std::chrono::milliseconds timeout);

  /// Whether a frame of this session is the final result of the newest update that was not refused.
  bool is_result(const Frame& frame) const;

  /// Undoes the newest step of the handles on the server, or redoes the step that was undone last; for steps see
  /// Update::begins_step in types.h. Sent after all earlier updates. Waits for the answer, not for the frame. Returns
  /// the number of the update that the undo is. Errors: FAILED_PRECONDITION (NOTHING_TO_UNDO, also for steps from
  /// before the session had to be created again; NOTHING_TO_REDO; SESSION_CLOSED); ABORTED (INPUT_SEQ_PASSED) if
  /// another update arrived before it; DEADLINE_EXCEEDED.
  absl::StatusOr<std::uint64_t> undo();
  absl::StatusOr<std::uint64_t> redo();

  /// Shows the better shape that the notice kBetterShape has announced, as a new final frame for the same update. The shape
  /// is not part of steps for undo. Waits for the answer, not for the frame. Not retried: after UNAVAILABLE or
  /// DEADLINE_EXCEEDED the shape may have been taken, which a frame then shows. FAILED_PRECONDITION (NO_BETTER_SHAPE if none
  /// is known for the newest update, as after solve (see MinimaSearch); NOT_THE_WRITER; SESSION_CLOSED).
  absl::StatusOr<BetterShape> take_better_shape();

  /// Solves for the current handles and settings on the server; waits for the final result and returns it. Works with
  /// and without the stream of frames. If the server becomes unreachable, the solve is retried within the deadline and
  /// for at most reconnect_for. Only one solve runs at a time; updates made meanwhile are sent after it. If another
  /// thread calls close(), the solve ends early with CANCELLED or, if it has not begun yet, with FAILED_PRECONDITION
  /// SESSION_CLOSED. Errors: what the server refuses; DEADLINE_EXCEEDED (SOLVE_UNDER_WAY if the time was spent waiting
  /// for another solve or update); UNAVAILABLE.
  absl::StatusOr<SolveResult> solve(const SolveOptions& options = {});

  /// The session as a file, including every earlier update, for Client::open_snapshot; see Client::snapshot. Waits
  /// until all parts have arrived; updates made meanwhile are sent after it. Errors: the server's error about an
  /// earlier update; RESOURCE_EXHAUSTED, DEADLINE_EXCEEDED, UNAVAILABLE; CANCELLED if close() is called meanwhile,
  /// FAILED_PRECONDITION SESSION_CLOSED after it.
  absl::StatusOr<std::string> snapshot();

  /// Becomes the writer, replacing the present one: after WRITER_REPLACED, or as a reader. Waits for the server.
  absl::Status take_over();

  /// "sessions/<32 hexadecimal digits>". Changes when the session had to be created again.
  std::string name() const;
  /// Opens the stream of frames, which otherwise opens with the first call for a frame. Does not wait.
  void start();
  /// Why the session has ended, as next_frame returns it; OK while it has not.
  absl::Status ended() const;
  /// The error with which the connection broke last, or with which the last attempt to reconnect failed; OK while it is
  /// connected.
  absl::Status last_problem() const;
  /// The notice of a better shape for as long as it applies: until the shape is shown, a frame for a later update
  /// arrives, or a solve() ends. Otherwise the last notice from the server about itself on the present stream of frames. Empty if there was
  /// none, and while the stream is down.
  std::optional<Notice> notice() const;
  /// The server's report on the mesh.
  MeshReport mesh_report() const;
  Connection connection() const;

  /// Ends the stream and every waiting call. Deletes the session on the server if open() created it. If this fails,
  /// returns the error; the session then expires by itself. Waits for the server for at most two seconds. A second call
  /// returns OK at once.
  absl::Status close();

 private:
  friend class Client;
  explicit Session(std::unique_ptr<Link> link);
  std::unique_ptr<Link> link_;
};

/// A connection to a server, shared by its sessions. Copies share the connection. Thread-safe.
class Client {
 public:
  /// Waits until the server answers or its address refuses. `address`: "host:port", or "unix:/path/of/socket".
  /// UNAVAILABLE (NO_SERVER); INVALID_ARGUMENT if the texts of `options.tls` are not certificates and their key. In all
  /// functions of Client, a request to stop ends the wait with CANCELLED.
  static absl::StatusOr<Client> connect(std::string_view address, ClientOptions options = {},
                                        const std::stop_token& stop = {});

  /// Creates a session on the server. Waits until the mesh is sent: in one message if it is small, otherwise in parts
  /// with a checksum. Errors: INVALID_ARGUMENT with the first element that cannot be deformed; RESOURCE_EXHAUSTED;
  /// UNAVAILABLE. Keeps `mesh` as long as the session lives.
  absl::StatusOr<Session> open(Mesh mesh, OpenOptions options = {}, const std::stop_token& stop = {});

  /// Creates a session from a file of Session::snapshot or snapshot(), on any server of the same version or a later
  /// one, with the same surface to the last bit. Ignores those `options` that the file determines: weights,
  /// free_components, weld and settings. If the server loses the session, it is created again from `file` and the later
  /// updates. Waits. INVALID_ARGUMENT (SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED); other
  /// errors as open().
  absl::StatusOr<Session> open_snapshot(std::string file, OpenOptions options = {},
                                        const std::stop_token& stop = {});

  /// Joins an existing session by name: as a reader of its frames, or as its writer, replacing the present one. If the
  /// server loses such a session, it is not created again, and close() does not delete it. Waits. NOT_FOUND if there is
  /// no such session.
  absl::StatusOr<Session> join(std::string_view session, Role role, OpenOptions options = {},
                               const std::stop_token& stop = {});

  /// A session as a file: mesh, handles, settings, undo steps and the current surface, but not the writer. Waits until
  /// all parts have arrived; the session continues meanwhile. NOT_FOUND if there is no such session.
  absl::StatusOr<std::string> snapshot(std::string_view session);

  /// Creates a session from such a file and leaves it on the server. Returns its name, for join(). The session ends
  /// when it was not used for a while, or by remove(). Waits. Errors as open_snapshot().
  absl::StatusOr<std::string> restore(std::string_view snapshot);

  /// Deletes a session by name. OK if there is none.
  absl::Status remove(std::string_view session);

 private:
  Client(std::shared_ptr<Rpc> rpc, ClientOptions options);
  std::shared_ptr<Rpc> rpc_;
  ClientOptions options_;
};

}  // namespace lpdeform::client
