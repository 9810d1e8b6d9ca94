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

/// After how long the server asks to try again what failed with this status; 0 where trying again does not help.
std::chrono::milliseconds retry_after(const absl::Status& status);

/// Connecting with TLS. Texts in PEM.
struct Tls {
  std::string root_certificates = {};  // whom to trust; empty: whom the system trusts
  std::string certificate_chain = {};  // our own, where the server asks for one
  std::string private_key = {};
};

struct ClientOptions {
  /// Of connect(), which does not wait where the address refuses at once.
  std::chrono::milliseconds connect_timeout = std::chrono::seconds(10);
  /// Of every other call but Session::solve, which has its own.
  std::chrono::milliseconds call_timeout = std::chrono::seconds(30);
  /// A live session whose server stays away for longer gives up; next_frame then says UNAVAILABLE for good. A
  /// solve under way says it too, and may be asked for again.
  std::chrono::milliseconds reconnect_for = std::chrono::minutes(2);
  std::optional<Tls> tls = {};  // empty: plain text
  /// Gives the bearer token of each call when that begins, so that tokens may be renewed; on any thread. Empty, or an empty text: none;
  /// a text with anything but printable ASCII counts as none.
  std::function<std::string()> token = {};
};

struct OpenOptions {
  WeightKind weights = WeightKind::kCotangent;
  FreeComponents free_components = FreeComponents::kError;
  Weld weld = {};
  Settings settings = {};
  /// Frames that may be under way and not yet taken, 1 to 8; 0 takes the server's 2.
  std::uint32_t credit = 0;
  bool double_precision = false;  // of the positions in frames on the wire, where the encoding is raw
  Encoding encoding = Encoding::kRaw;
  /// What the server may go down to where its limit of bytes a second asks for it; the frame rate comes first.
  Encoding lowest_encoding = Encoding::kRaw;
  bool without_distortion = false;
  bool with_normals = false;  // fills Frame::normals
  /// A result comes again with its Frame::optimality_gap, unless a new update comes first: the server looks for it
  /// once updates have paused for a tenth of a second.
  bool certify = false;
  double max_frames_per_second = 0;  // 0 is without limit; the last frame of an update always comes
};

enum class Role { kReader, kWriter };

enum class Connection { kIdle, kConnected, kReconnecting, kClosed };

/// A mesh being deformed on a server. Every function may be called from any thread at any time, except that
/// the destructor and a move must not overlap another call. Functions say whether they wait; those that do
/// not never take longer than copying their arguments.
///
/// Frames come over one stream that begins with the first call of next_frame, poll or settle. While the
/// stream is down it reconnects with growing pauses: to the same session where the server still has it,
/// otherwise to a new one that it makes from its own copy of mesh, handles and settings. Frames of an older
/// epoch or an older update than one that was shown are dropped.
class Session {
 public:
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  /// Closes.
  ~Session();

  /// Sends a change and returns its number: a frame whose input_seq is at least that takes it into account.
  /// Does not wait: changes made faster than the connection takes them are merged, the newest value of each
  /// handle and each setting winning. A change that the server refuses comes out of next_frame as an error,
  /// once; the session goes on without it, and without what was merged into it. Errors: FAILED_PRECONDITION
  /// once closed (SESSION_CLOSED) or for a reader (NOT_THE_WRITER); INVALID_ARGUMENT NAME_ENCODING where the name of a
  /// handle is not UTF-8.
  absl::StatusOr<std::uint64_t> update(Update update);

  /// Adds the handle or replaces the one of that name. As update().
  absl::StatusOr<std::uint64_t> set_handle(std::string_view name, Handle handle);
  /// Moves a handle. As update().
  absl::StatusOr<std::uint64_t> move(std::string_view name, Motion motion);
  /// Lets go of a handle. As update().
  absl::StatusOr<std::uint64_t> remove(std::string_view name);
  /// Changes p, stiffness, method and so on. As update().
  absl::StatusOr<std::uint64_t> set(Settings settings);

  /// The newest frame not yet taken; waits for one. Taking it tells the server to send on, so a caller who
  /// stops asking costs a bounded number of frames. Errors: DEADLINE_EXCEEDED; what the server had to say
  /// about an update (the session goes on); once the session is over, why (NOT_FOUND SESSION_DELETED, ABORTED
  /// WRITER_REPLACED, UNAVAILABLE, FAILED_PRECONDITION SESSION_CLOSED), on every call.
  absl::StatusOr<Frame> next_frame(std::chrono::milliseconds timeout);

  /// The same without waiting: empty where there is no new frame.
  absl::StatusOr<std::optional<Frame>> poll();

  /// Waits until next_frame has something to say, a frame or an error, and takes nothing. False where the time passed first.
  bool wait(std::chrono::milliseconds timeout);

  /// The finished result of the newest update. Takes frames until it is there; at once, and also with a timeout of 0, where the
  /// newest frame that was taken before, here or by next_frame or poll, is that result: also while the connection is down.
  /// Does not wait for its optimality_gap, which the next frame has. Errors as next_frame.
  absl::StatusOr<Frame> settle(std::chrono::milliseconds timeout);

  /// Whether a frame of this session is the finished result of the newest update that was not refused.
  bool is_result(const Frame& frame) const;

  /// Takes the newest step of the handles back on the server, or does again what was taken back last: see types.h. Sent
  /// after all updates before it; waits for the answer, not for the frame. The number of the update that this is. Errors:
  /// FAILED_PRECONDITION (NOTHING_TO_UNDO, also of what came before the session had to be made anew; NOTHING_TO_REDO;
  /// SESSION_CLOSED); ABORTED (INPUT_SEQ_PASSED) where another update came before it; DEADLINE_EXCEEDED.
  absl::StatusOr<std::uint64_t> undo();
  absl::StatusOr<std::uint64_t> redo();

  /// Solves for the present handles and settings on the server and returns the finished result; waits for it.
  /// Does not need the stream of frames, but works beside it. Begins again where the server went away, within
  /// the deadline and for as long as the stream would try. One at a time; while one runs, updates wait and are
  /// sent after it. When close() is called from another thread it ends early: with CANCELLED, or where it still
  /// waited for another, with FAILED_PRECONDITION SESSION_CLOSED. Errors: what the server refuses;
  /// DEADLINE_EXCEEDED (SOLVE_UNDER_WAY where it was spent waiting for another solve or update); UNAVAILABLE.
  absl::StatusOr<SolveResult> solve(const SolveOptions& options = {});

  /// The session as a file, with every update before it: for Client::open_snapshot, see Client::snapshot. Waits for it to come in
  /// parts; updates made meanwhile are sent after it. Errors: what the server says of an update before it; RESOURCE_EXHAUSTED,
  /// DEADLINE_EXCEEDED, UNAVAILABLE; CANCELLED where close() is called meanwhile, FAILED_PRECONDITION SESSION_CLOSED after.
  absl::StatusOr<std::string> snapshot();

  /// Becomes the writer in place of whoever is, after WRITER_REPLACED or as a reader. Waits for the server.
  absl::Status take_over();

  /// "sessions/<32 hexadecimal digits>"; another one after the session had to be made anew.
  std::string name() const;
  /// Begins the stream of frames, which the first call for one does otherwise. Does not wait.
  void start();
  /// Why the session is over, as next_frame says it then; OK while it is not.
  absl::Status ended() const;
  /// What the connection met with when it was lost last, or when reconnecting was tried last; OK while it stands.
  absl::Status last_problem() const;
  /// What the server said about itself last, on the stream of frames that there is. Empty where it said nothing, and while
  /// the stream is down.
  std::optional<Notice> notice() const;
  /// What the server found in the mesh.
  MeshReport mesh_report() const;
  Connection connection() const;

  /// Ends the stream and every waiting call. Deletes the session on the server where open() made it; a
  /// failure to do so is returned, and the session expires by itself. Waits for the server at most
  /// two seconds. Again: OK at once.
  absl::Status close();

 private:
  friend class Client;
  explicit Session(std::unique_ptr<Link> link);
  std::unique_ptr<Link> link_;
};

/// A connection to a server, shared by its sessions. Copies share it; every function may be called from any
/// thread.
class Client {
 public:
  /// Waits until the server answers or its address refuses. `address`: "host:port", or
  /// "unix:/path/of/socket". UNAVAILABLE (NO_SERVER); INVALID_ARGUMENT where the texts of `options.tls` are not certificates
  /// and their key. Here and below, a request to stop ends the wait with CANCELLED.
  static absl::StatusOr<Client> connect(std::string_view address, ClientOptions options = {},
                                        const std::stop_token& stop = {});

  /// Makes a session on the server. Waits for the mesh to be sent: in one message where it is small,
  /// otherwise in parts with a checksum. Errors: INVALID_ARGUMENT with the first element that cannot be
  /// deformed; RESOURCE_EXHAUSTED; UNAVAILABLE. Keeps `mesh` for as long as the session lives.
  absl::StatusOr<Session> open(Mesh mesh, OpenOptions options = {}, const std::stop_token& stop = {});

  /// Makes a session from a file of Session::snapshot or snapshot(), on any server of the same version or a later one, with the
  /// same surface to the last bit. Of `options`, what the file says of the mesh (weights, free_components, weld) and settings are
  /// not used. Where the server loses the session, it is made anew from `file` and from what came after. Waits.
  /// INVALID_ARGUMENT (SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED); otherwise as open().
  absl::StatusOr<Session> open_snapshot(std::string file, OpenOptions options = {},
                                        const std::stop_token& stop = {});

  /// Joins somebody's session by name: as a reader of its frames, or taking over as its writer. Such a
  /// session is not made anew where the server loses it, and not deleted by close(). NOT_FOUND where there is
  /// none.
  absl::StatusOr<Session> join(std::string_view session, Role role, OpenOptions options = {},
                               const std::stop_token& stop = {});

  /// A session as a file: mesh, handles, settings, what can be undone and the surface as it is, but not who writes. Waits for it
  /// to come in parts; the session goes on meanwhile. NOT_FOUND where there is none.
  absl::StatusOr<std::string> snapshot(std::string_view session);

  /// Makes a session from such a file and leaves it on the server; its name, to join(). It goes when nobody has used it for a
  /// while, or by remove(). Waits. Errors as open_snapshot().
  absl::StatusOr<std::string> restore(std::string_view snapshot);

  /// Deletes a session by name. OK where there is none.
  absl::Status remove(std::string_view session);

 private:
  Client(std::shared_ptr<Rpc> rpc, ClientOptions options);
  std::shared_ptr<Rpc> rpc_;
  ClientOptions options_;
};

}  // namespace lpdeform::client
